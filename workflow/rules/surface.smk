# What a scan shows, and surfaces sampled from the models fitted to it.
# In:  the user's scan, or results/<scene>/scan.x3p where the scene has one made.
# Out: surface/scan.nc with statistics and fitted models, surface/synthetic_surfaces.nc.


rule grinding:
    input:
        key=scenes.key("grinding"),
    output:
        **outputs("grinding"),
    log:
        log("grinding"),
    resources:
        mem_mb=scenes.memory("grinding"),
    shell:
        run("grinding")


rule scan:
    input:
        key=scenes.key("scan"),
        scan=lambda wildcards: scenes.scan_file(wildcards.scene),
    output:
        **outputs("scan"),
    log:
        log("scan"),
    resources:
        mem_mb=scenes.memory("scan"),
    shell:
        run("scan")


rule synthetic_surfaces:
    input:
        key=scenes.key("synthetic_surfaces"),
        scan=scenes.made("scan"),
    output:
        **outputs("synthetic_surfaces"),
    log:
        log("synthetic_surfaces"),
    resources:
        mem_mb=scenes.memory("synthetic_surfaces"),
    shell:
        run("synthetic_surfaces")
