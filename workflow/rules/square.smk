# The square of Figure 2 and of the whole field of pressures.
# In:  key files.
# Out: surface/modes.nc, surface/design.nc, contact/square-<design>-<first>-<last>.nc, contact/training.nc where the number of
#      training samples is found while running, chaos/square.nc; chaos/field.nc.


rule surface:
    input:
        key=scenes.key("surface"),
        scan=scan_models,
    output:
        result="results/{scene}/surface/modes.nc",
        usage="results/{scene}/usage/surface.json",
    log:
        "results/{scene}/logs/surface.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("surface"),
    params:
        scan=scan_option,
    shell:
        STAGE
        + ".surface --key {input.key:q} {params.scan} --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule design:
    input:
        key=scenes.key("design"),
        surface=rules.surface.output.result,
    output:
        result="results/{scene}/surface/design.nc",
        usage="results/{scene}/usage/design.json",
    log:
        "results/{scene}/logs/design.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("design"),
    shell:
        STAGE + ".design --key {input.key:q} --surface {input.surface:q}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule contact_square:
    input:
        key=scenes.key("contact_square"),
        scan=scan_models,
        surface=rules.surface.output.result,
        design=rules.design.output.result,
    output:
        result="results/{scene}/contact/square-{design}-{first}-{last}.nc",
        usage="results/{scene}/usage/contact_square-{design}-{first}-{last}.json",
    log:
        "results/{scene}/logs/contact_square-{design}-{first}-{last}.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("contact_square"),
    params:
        scan=scan_option,
    shell:
        STAGE
        + ".contact_square --key {input.key:q} {params.scan} --surface {input.surface:q} --design {input.design:q}"
        " --design_name {wildcards.design} --first {wildcards.first} --last {wildcards.last}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule training_square:
    input:
        key=scenes.key("training_square"),
        scan=scan_models,
        surface=rules.surface.output.result,
    output:
        result="results/{scene}/contact/training.nc",
        usage="results/{scene}/usage/training_square.json",
    log:
        "results/{scene}/logs/training_square.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("training_square"),
    params:
        scan=scan_option,
    shell:
        STAGE + ".training_square --key {input.key:q} {params.scan} --surface {input.surface:q}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule chaos_square:
    input:
        key=scenes.key("chaos_square"),
        scan=scan_models,
        surface=rules.surface.output.result,
        design=rules.design.output.result,
        contact=lambda wildcards: scenes.square_contacts(wildcards.scene) + scenes.square_training(wildcards.scene),
    output:
        result="results/{scene}/chaos/square.nc",
        usage="results/{scene}/usage/chaos_square.json",
    log:
        "results/{scene}/logs/chaos_square.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("chaos_square"),
    params:
        scan=scan_option,
    shell:
        STAGE + ".chaos_square --key {input.key:q} {params.scan} --surface {input.surface:q} --design {input.design:q}"
        " --contact {input.contact:q} --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule field_square:
    input:
        key=scenes.key("field_square"),
        scan=scan_models,
        surface=rules.surface.output.result,
    output:
        result="results/{scene}/chaos/field.nc",
        usage="results/{scene}/usage/field_square.json",
    log:
        "results/{scene}/logs/field_square.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("field_square"),
    params:
        scan=scan_option,
    shell:
        STAGE + ".field_square --key {input.key:q} {params.scan} --surface {input.surface:q}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"
