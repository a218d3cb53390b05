# What a scene is for.
# In:  results of the stages that the targets of the scene need.
# Out: figures as png|svg|nc, claims.json, costs.json, report.html.

FIGURES = (
    *("figure2", "figure2_traps", "figure3", "figure3_law"),
    *("figure_field", "figure_lifetimes", "figure_map", "figure_scan"),
)

for figure in FIGURES:

    rule:
        name:
            figure
        input:
            **scenes.inputs(figure),
            key=scenes.key(figure),
        output:
            **outputs(figure),
        log:
            log(figure),
        resources:
            mem_mb=scenes.memory(figure),
        params:
            module=figure,
            caption=declarations()[figure].caption,
        shell:
            run("figure2", module="{params.module}")  # figure2 has the options of all stages of this loop


rule figure5:
    input:
        **scenes.inputs("figure5"),
        key=scenes.key("figure5"),
    output:
        **outputs("figure5"),
    log:
        log("figure5"),
    resources:
        mem_mb=scenes.memory("figure5"),
    params:
        caption=declarations()["figure5"].caption,
    shell:
        run("figure5")


rule figure_chain:
    input:
        **scenes.inputs("figure_chain"),
        key=scenes.key("figure_chain"),
    output:
        **outputs("figure_chain"),
    log:
        log("figure_chain"),
    resources:
        mem_mb=scenes.memory("figure_chain"),
    params:
        caption=declarations()["figure_chain"].caption,
    shell:
        run("figure_chain")


rule claims:
    input:
        **scenes.inputs("claims"),
        key=scenes.key("claims"),
    output:
        **outputs("claims"),
    log:
        log("claims"),
    resources:
        mem_mb=scenes.memory("claims"),
    shell:
        run("claims")


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
