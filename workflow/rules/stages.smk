# The stages of a scene: a rule for each, of what its declaration says (src/roughslip/scene/declarations.py).
# In:  its key file, the results of the stages that it declares as inputs, and those of OTHER_INPUTS.
# Out: its result in results/<scene>, its record of cost and its log; figures as png|svg|nc. ARCHITECTURE.md lists them.
# `scenes` is workflow/study/scenes.py; RUN, log, options_of, outputs and run are workflow/study/commands.py.

# Inputs that are no result of another stage, or only some of them, by stage and option.
OTHER_INPUTS = {
    "scan": {"scan": lambda wildcards: scenes.scan_file(wildcards.scene)},
    "chaos_strip": {"contact": scenes.made("contact_strip", below="strip.training_samples")},
    "costs": {"records": lambda wildcards: scenes.usage_records(wildcards.scene)},
}

for stage in sorted(declarations().keys() - {"report", *plan.stages_of_several_scenes()}):

    rule:
        name:
            stage
        input:
            **{"key": scenes.key(stage), **scenes.inputs(stage), **OTHER_INPUTS.get(stage, {})},
        output:
            **outputs(stage),
        log:
            log(stage),
        resources:
            mem_mb=scenes.memory(stage),
        params:
            module=stage,
            options=options_of(stage),
            caption=declarations()[stage].caption,
        shell:
            RUN


rule scene_report:
    input:
        key=scenes.key("report"),
        scenes=scenes.made("claims", "costs"),
        figures=lambda wildcards: scenes.figures(wildcards.scene),
        surfaces=scenes.made("karhunen_loeve", "chaos_square", "scan"),
    output:
        **outputs("report"),
    log:
        log("report"),
    resources:
        mem_mb=scenes.memory("report"),
    shell:
        run("report", scenes="results/{wildcards.scene}", evidence="", drawn="")
