# The strips of Figure 3.
# In:  key files.
# Out: contact/strip-<first>-<last>.nc, chaos/strip.nc, friction/expansion-<first>-<last>.nc, friction/statistics.nc, summary.csv.


rule contact_strip:
    input:
        key=scenes.key("contact_strip"),
        scan=scan_models,
    output:
        result="results/{scene}/contact/strip-{first}-{last}.nc",
        usage="results/{scene}/usage/contact_strip-{first}-{last}.json",
    log:
        "results/{scene}/logs/contact_strip-{first}-{last}.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("contact_strip"),
    params:
        scan=scan_option,
    shell:
        STAGE + ".contact_strip --key {input.key:q} {params.scan} --first {wildcards.first} --last {wildcards.last}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule chaos_strip:
    input:
        key=scenes.key("chaos_strip"),
        scan=scan_models,
        contact=lambda wildcards: scenes.training_contacts(wildcards.scene),
    output:
        result="results/{scene}/chaos/strip.nc",
        usage="results/{scene}/usage/chaos_strip.json",
    log:
        "results/{scene}/logs/chaos_strip.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("chaos_strip"),
    params:
        scan=scan_option,
    shell:
        STAGE + ".chaos_strip --key {input.key:q} {params.scan} --contact {input.contact:q}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule expansion_strip:
    input:
        key=scenes.key("expansion_strip"),
        scan=scan_models,
        expansion=rules.chaos_strip.output.result,
    output:
        result="results/{scene}/friction/expansion-{first}-{last}.nc",
        usage="results/{scene}/usage/expansion_strip-{first}-{last}.json",
    log:
        "results/{scene}/logs/expansion_strip-{first}-{last}.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("expansion_strip"),
    params:
        scan=scan_option,
    shell:
        STAGE + ".expansion_strip --key {input.key:q} {params.scan} --expansion {input.expansion:q}"
        " --first {wildcards.first} --last {wildcards.last} --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule friction:
    input:
        key=scenes.key("friction"),
        contact=lambda wildcards: scenes.strip_contacts(wildcards.scene),
        expansion=lambda wildcards: scenes.expansion_strips(wildcards.scene),
    output:
        result="results/{scene}/friction/statistics.nc",
        summary="results/{scene}/summary.csv",
        usage="results/{scene}/usage/friction.json",
    log:
        "results/{scene}/logs/friction.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("friction"),
    shell:
        STAGE + ".friction --key {input.key:q} --contact {input.contact:q} --expansion {input.expansion:q}"
        " --summary {output.summary:q} --output {output.result:q} --usage {output.usage:q} 2> {log:q}"
