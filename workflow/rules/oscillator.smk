# The mass on the belt of Figure 5.
# In:  key files; friction/statistics.nc unless the scene gives the statistics as numbers.
# Out: oscillator/deterministic.nc, oscillator/ensemble-<first>-<last>.nc.


def friction_statistics(wildcards):
    """The statistics where a surface gives them, else nothing."""
    return (
        [rules.friction.output.result.format(scene=wildcards.scene)]
        if "friction" in scenes.stages(wildcards.scene)
        else []
    )


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
    params:
        friction=lambda wildcards, input: f"--friction {shlex.quote(input.friction[0])}" if input.friction else "",
    shell:
        STAGE + ".deterministic --key {input.key:q} {params.friction}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule oscillator:
    input:
        key=scenes.key("oscillator"),
        friction=friction_statistics,
    output:
        result="results/{scene}/oscillator/ensemble-{first}-{last}.nc",
        usage="results/{scene}/usage/oscillator-{first}-{last}.json",
    log:
        "results/{scene}/logs/oscillator-{first}-{last}.log",
    threads: 1
    params:
        friction=lambda wildcards, input: f"--friction {shlex.quote(input.friction[0])}" if input.friction else "",
    shell:
        STAGE + ".oscillator --key {input.key:q} {params.friction} --first {wildcards.first} --last {wildcards.last}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"
