# The mass on the belt: Figure 5, and where stick-slip occurs.
# In:  friction/statistics.nc unless the scene gives the statistics as numbers.
# Out: oscillator/deterministic.nc, oscillator/ensemble-<first>-<last>.nc, oscillator/statistics.nc, oscillator/map.nc,
#      oscillator/readings.nc, oscillator/lifetimes.nc, answer.json; oscillator/allocation.nc where an accuracy is asked.


# Stages that take the friction statistics alone.
for stage in ("deterministic", "belt_readings", "ensemble_pilot", "stick_slip_map", "lifetimes", "answer"):

    rule:
        name:
            stage
        input:
            key=scenes.key(stage),
            friction=scenes.made("friction"),
        output:
            **outputs(stage),
        log:
            log(stage),
        resources:
            mem_mb=scenes.memory(stage),
        params:
            module=stage,
        shell:
            run("deterministic", module="{params.module}")  # deterministic has the options of all stages of this loop


rule oscillator:
    input:
        key=scenes.key("oscillator"),
        friction=scenes.made("friction"),
        allocation=scenes.made("ensemble_pilot"),
    output:
        **outputs("oscillator"),
    log:
        log("oscillator"),
    resources:
        mem_mb=scenes.memory("oscillator"),
    shell:
        run("oscillator")


rule cycles:
    input:
        key=scenes.key("cycles"),
        deterministic=scenes.made("deterministic"),
        allocation=scenes.made("ensemble_pilot"),
        ensemble=scenes.made("oscillator"),
    output:
        **outputs("cycles"),
    log:
        log("cycles"),
    resources:
        mem_mb=scenes.memory("cycles"),
    shell:
        run("cycles")
