# What a scan shows, and surfaces sampled after it.
# In:  key files; the user's scan, or results/<scene>/scan.x3p where the scene has one made.
# Out: surface/scan.nc with statistics and fitted models, surface/twins.nc.


def scan_models(wildcards):
    """The models of a scan where the surface is after one, else nothing."""
    return [rules.scan.output.result.format(scene=wildcards.scene)] if "scan" in scenes.stages(wildcards.scene) else []


def scan_option(wildcards, input):
    """What hands them to a stage."""
    return f"--scan {shlex.quote(input.scan[0])}" if input.scan else ""


rule grinding:
    input:
        key=scenes.key("grinding"),
    output:
        result="results/{scene}/scan.x3p",
        usage="results/{scene}/usage/grinding.json",
    log:
        "results/{scene}/logs/grinding.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("grinding"),
    shell:
        STAGE + ".grinding --key {input.key:q} --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule scan:
    input:
        key=scenes.key("scan"),
        scan=lambda wildcards: scenes.scan_file(wildcards.scene),
    output:
        result="results/{scene}/surface/scan.nc",
        usage="results/{scene}/usage/scan.json",
    log:
        "results/{scene}/logs/scan.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("scan"),
    shell:
        STAGE + ".scan --key {input.key:q} --scan {input.scan:q}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule twins:
    input:
        key=scenes.key("twins"),
        scan=rules.scan.output.result,
    output:
        result="results/{scene}/surface/twins.nc",
        usage="results/{scene}/usage/twins.json",
    log:
        "results/{scene}/logs/twins.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("twins"),
    shell:
        STAGE + ".twins --key {input.key:q} --scan {input.scan:q}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"
