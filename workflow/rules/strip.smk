# The strips of Figure 3. `scenes` is workflow/study/scenes.py; outputs, log and run are workflow/study/commands.py.
# In:  surface/scan.nc where the surface is that of a scan.
# Out: contact/pilot.nc and friction/allocation.nc where an accuracy is asked; contact/strip-<first>-<last>.nc, chaos/strip.nc, friction/expansion-<first>-<last>.nc, friction/statistics.nc, summary.csv.


rule strip_pilot:
    input:
        key=scenes.key("strip_pilot"),
        scan=scenes.made("scan"),
    output:
        **outputs("strip_pilot"),
    log:
        log("strip_pilot"),
    resources:
        mem_mb=scenes.memory("strip_pilot"),
    shell:
        run("strip_pilot")


rule strip_allocation:
    input:
        key=scenes.key("strip_allocation"),
        scan=scenes.made("scan"),
        pilot=scenes.made("strip_pilot"),
        expansion=scenes.made("chaos_strip"),
    output:
        **outputs("strip_allocation"),
    log:
        log("strip_allocation"),
    resources:
        mem_mb=scenes.memory("strip_allocation"),
    shell:
        run("strip_allocation")


rule contact_strip:
    input:
        key=scenes.key("contact_strip"),
        scan=scenes.made("scan"),
        allocation=scenes.made("strip_allocation"),
    output:
        **outputs("contact_strip"),
    log:
        log("contact_strip"),
    resources:
        mem_mb=scenes.memory("contact_strip"),
    shell:
        run("contact_strip")


rule chaos_strip:
    input:
        key=scenes.key("chaos_strip"),
        scan=scenes.made("scan"),
        contact=scenes.training_strips,
    output:
        **outputs("chaos_strip"),
    log:
        log("chaos_strip"),
    resources:
        mem_mb=scenes.memory("chaos_strip"),
    shell:
        run("chaos_strip")


rule expansion_strip:
    input:
        key=scenes.key("expansion_strip"),
        scan=scenes.made("scan"),
        allocation=scenes.made("strip_allocation"),
        expansion=scenes.made("chaos_strip"),
    output:
        **outputs("expansion_strip"),
    log:
        log("expansion_strip"),
    resources:
        mem_mb=scenes.memory("expansion_strip"),
    shell:
        run("expansion_strip")


rule friction:
    input:
        key=scenes.key("friction"),
        scan=scenes.made("scan"),
        contact=scenes.made("strip_pilot", "contact_strip"),
        allocation=scenes.made("strip_allocation"),
        expansion=scenes.made("expansion_strip"),
    output:
        **outputs("friction"),
    log:
        log("friction"),
    resources:
        mem_mb=scenes.memory("friction"),
    shell:
        run("friction")
