# The square of Figure 2, and the field of pressures on it.
# In:  surface/scan.nc where the surface is that of a scan.
# Out: surface/modes.nc, surface/design.nc, contact/square-<design>-<first>-<last>.nc, chaos/square.nc, chaos/field.nc;
#      contact/square_pilot.nc and contact/training.nc where an accuracy is asked.


rule karhunen_loeve:
    input:
        key=scenes.key("karhunen_loeve"),
        scan=scenes.made("scan"),
    output:
        **outputs("karhunen_loeve"),
    log:
        log("karhunen_loeve"),
    resources:
        mem_mb=scenes.memory("karhunen_loeve"),
    shell:
        run("karhunen_loeve")


rule design:
    input:
        key=scenes.key("design"),
        surface=scenes.made("karhunen_loeve"),
    output:
        **outputs("design"),
    log:
        log("design"),
    resources:
        mem_mb=scenes.memory("design"),
    shell:
        run("design")


rule contact_square:
    input:
        key=scenes.key("contact_square"),
        scan=scenes.made("scan"),
        surface=scenes.made("karhunen_loeve"),
        designs=scenes.made("design"),
        pilot=scenes.made("square_pilot"),
    output:
        **outputs("contact_square"),
    log:
        log("contact_square"),
    resources:
        mem_mb=scenes.memory("contact_square"),
    shell:
        run("contact_square")


# Stages that solve samples of their own.
for stage in ("square_pilot", "adaptive_training", "field_square"):

    rule:
        name:
            stage
        input:
            key=scenes.key(stage),
            scan=scenes.made("scan"),
            surface=scenes.made("karhunen_loeve"),
        output:
            **outputs(stage),
        log:
            log(stage),
        resources:
            mem_mb=scenes.memory(stage),
        params:
            module=stage,
        shell:
            run("field_square", module="{params.module}")  # field_square has the options of all stages of this loop


rule chaos_square:
    input:
        key=scenes.key("chaos_square"),
        scan=scenes.made("scan"),
        surface=scenes.made("karhunen_loeve"),
        designs=scenes.made("design"),
        pilot=scenes.made("square_pilot"),
        contact=scenes.made("contact_square", "adaptive_training"),
    output:
        **outputs("chaos_square"),
    log:
        log("chaos_square"),
    resources:
        mem_mb=scenes.memory("chaos_square"),
    shell:
        run("chaos_square")
