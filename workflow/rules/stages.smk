# The stages: one rule each, made from its declaration. What a job reads stands in its key file.
# In:  results/store/<stage>/<key>/key.json; the records of the jobs before it, as long as it has not ended.
# Out: results/store/<stage>/<key>/<result of the stage>, usage/<job>.json; results/<scene>/..., published from these.
RULE_NAMES = {"report": "scene_report"}
OVER_PUBLISHED = {"verify", "reference"}  # workflow/rules/several_scenes.smk


for stage in sorted(declarations().keys() - OVER_PUBLISHED):

    rule:
        name:
            RULE_NAMES.get(stage, stage)
        input:
            inputs.of_stage(stage),
        output:
            **outputs(stage, lambda wildcards, stage=stage: inputs.entry(stage, wildcards).scene),
        log:
            log(stage),
        resources:
            mem_mb=lambda wildcards, attempt, stage=stage: asked_mb(stage, attempt, options["memory_mb"]),
        params:
            scene=lambda wildcards, stage=stage: inputs.entry(stage, wildcards).scene,
            command=lambda wildcards, stage=stage: command(stage).format(wildcards=wildcards),
            caption=declarations()[stage].caption,
        message:
            f"{stage}: {{params.scene}}{''.join(f' {{wildcards.{name}}}' for name in declarations()[stage].placeholders)}"
        shell:
            "{params.command} 2> {log:q}"


rule publish:
    input:
        inputs.of_scene,
    output:
        f"results/{{scene}}/{LISTED}",
    log:
        "results/{scene}/logs/publish.log",
    localrule: True
    params:
        key=lambda wildcards: names.publication(wildcards.scene).folder,
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.publish {params.key}/key.json results/{wildcards.scene} --list 2> {log:q}'


# One file by the name under which people open it.
rule one_file:
    input:
        unpack(inputs.of_scene_file),
    output:
        "results/{scene}/{file}",
    log:
        "results/{scene}/logs/publish-{file}.log",
    localrule: True
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.publish {input.source:q} {output:q} 2> {log:q}'
