# The stages of a scene. A rule is made from the declaration of its stage; those that the declaration does not give whole
# follow. `scenes` is workflow/study/scenes.py; outputs, log, command and run are workflow/study/commands.py.
# In:  the scene files; the user's scan.
# Out: results/<scene>/<result of the stage>, results/<scene>/usage/<job>.json.
OTHERWISE = {"chaos_strip", "scan", "costs", "report", *plan.stages_of_several_scenes()}  # their rules are written out

for stage in sorted(declarations().keys() - OTHERWISE):

    rule:
        name:
            stage
        input:
            **scenes.inputs(stage),
            key=scenes.key(stage),
        output:
            **outputs(stage),
        log:
            log(stage),
        resources:
            mem_mb=scenes.memory(stage),
        params:
            command=command(stage),
            caption=declarations()[stage].caption,
        shell:
            "{params.command} 2> {log:q}"


# Training strips are those of the pilot, or of the first batches.
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


# The scan is the user's, or results/<scene>/scan.x3p where the scene has one made.
rule scan:
    input:
        key=scenes.key("scan"),
        scan=lambda wildcards: scenes.scan_file(wildcards.scene),
    output:
        **outputs("scan"),
    log:
        log("scan"),
    resources:
        mem_mb=scenes.memory("scan"),
    shell:
        run("scan")


rule costs:
    input:
        key=scenes.key("costs"),
        records=lambda wildcards: scenes.usage_records(wildcards.scene),
    output:
        **outputs("costs"),
    log:
        log("costs"),
    resources:
        mem_mb=scenes.memory("costs"),
    shell:
        run("costs")


rule scene_report:
    input:
        key=scenes.key("report"),
        scenes=scenes.made("claims", "costs"),
        figures=lambda wildcards: scenes.figures(wildcards.scene),
        surfaces=scenes.made("karhunen_loeve", "chaos_square", "scan"),
        answer=scenes.made("answer"),
    output:
        **outputs("report"),
    log:
        log("report"),
    resources:
        mem_mb=scenes.memory("report"),
    shell:
        run("report", scenes="results/{wildcards.scene}", evidence="", drawn="")
