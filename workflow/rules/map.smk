# Where stick-slip lives: over damping and belt velocity, and near its limits.
# In:  key files; friction/statistics.nc unless the scene gives the statistics as numbers.
# Out: oscillator/map.nc, oscillator/survival.nc, figure_map.png|svg|nc


rule stick_slip_map:
    input:
        key=scenes.key("stick_slip_map"),
        friction=friction_statistics,
    output:
        result="results/{scene}/oscillator/map.nc",
        usage="results/{scene}/usage/stick_slip_map.json",
    log:
        "results/{scene}/logs/stick_slip_map.log",
    threads: 1
    params:
        friction=friction_option,
    shell:
        STAGE + ".stick_slip_map --key {input.key:q} {params.friction}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule survival:
    input:
        key=scenes.key("survival"),
        friction=friction_statistics,
    output:
        result="results/{scene}/oscillator/survival.nc",
        usage="results/{scene}/usage/survival.json",
    log:
        "results/{scene}/logs/survival.log",
    threads: 1
    params:
        friction=friction_option,
    shell:
        STAGE + ".survival --key {input.key:q} {params.friction}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule figure_map:
    input:
        key=scenes.key("figure_map"),
        map=rules.stick_slip_map.output.result,
        survival=rules.survival.output.result,
    output:
        numbers="results/{scene}/figure_map.nc",
        png=report("results/{scene}/figure_map.png", caption="../report/figure_map.rst", category="{scene}"),
        svg="results/{scene}/figure_map.svg",
        usage="results/{scene}/usage/figure_map.json",
    log:
        "results/{scene}/logs/figure_map.log",
    threads: 1
    shell:
        STAGE + ".figure_map --key {input.key:q} --map {input.map:q} --survival {input.survival:q}"
        " --png {output.png:q} --svg {output.svg:q} --output {output.numbers:q} --usage {output.usage:q} 2> {log:q}"
