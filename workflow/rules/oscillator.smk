# The mass on the belt of Figure 5.
# In:  key files; friction/statistics.nc unless the scene gives the statistics as numbers.
# Out: oscillator/deterministic.nc, oscillator/spacing.nc where the number of nodes is left to the study,
#      oscillator/ensemble-<first>-<last>.nc.


def friction_statistics(wildcards):
    """The statistics where a surface gives them, else nothing."""
    return (
        [rules.friction.output.result.format(scene=wildcards.scene)]
        if "friction" in scenes.stages(wildcards.scene)
        else []
    )


def friction_option(wildcards, input):
    """The option that hands them to a stage."""
    return f"--friction {shlex.quote(input.friction[0])}" if input.friction else ""


rule deterministic:
    input:
        key=scenes.key("deterministic"),
        friction=friction_statistics,
    output:
        result="results/{scene}/oscillator/deterministic.nc",
        usage="results/{scene}/usage/deterministic.json",
    log:
        "results/{scene}/logs/deterministic.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("deterministic"),
    params:
        friction=friction_option,
    shell:
        STAGE + ".deterministic --key {input.key:q} {params.friction}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule spacing:
    input:
        key=scenes.key("spacing"),
        friction=friction_statistics,
    output:
        result="results/{scene}/oscillator/spacing.nc",
        usage="results/{scene}/usage/spacing.json",
    log:
        "results/{scene}/logs/spacing.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("spacing"),
    params:
        friction=friction_option,
    shell:
        STAGE + ".spacing --key {input.key:q} {params.friction}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule oscillator:
    input:
        key=scenes.key("oscillator"),
        friction=friction_statistics,
        spacing=lambda wildcards: scenes.spacing(wildcards.scene),
    output:
        result="results/{scene}/oscillator/ensemble-{first}-{last}.nc",
        usage="results/{scene}/usage/oscillator-{first}-{last}.json",
    log:
        "results/{scene}/logs/oscillator-{first}-{last}.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("oscillator"),
    params:
        friction=friction_option,
        spacing=lambda wildcards, input: f"--spacing {shlex.quote(input.spacing[0])}" if input.spacing else "",
    shell:
        STAGE
        + ".oscillator --key {input.key:q} {params.friction} {params.spacing} --first {wildcards.first} --last {wildcards.last}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"
