# The stages: one rule each, made from its row in the graph. What a job reads stands in its key file.
# In:  results/store/<stage>/<key>/key.json; the records of the jobs before it, as long as it has not ended.
# Out: results/store/<stage>/<key>/<result of the stage>, usage/<job>.json; results/<scene>/..., published from these.
ASKED = frozenset().union(*map(scenes.stages, scenes.asked))
JOBS = [row for row in STAGES.values() if not row.caption and row.name != "verify"]


for row in JOBS:

    rule:
        name:
            row.name
        input:
            inputs.of_stage(row.name),
        output:
            **outputs(row.name, lambda wildcards, stage=row.name: inputs.entry(stage, wildcards).scene),
        log:
            log(row.name),
        priority: stages_after(row.name, ASKED)
        resources:
            mem_mb=lambda wildcards, attempt, stage=row.name: asked_mb(stage, attempt, options["memory_mb"]),
        params:
            scene=lambda wildcards, stage=row.name: inputs.entry(stage, wildcards).scene,
            command=lambda wildcards, stage=row.name: command(stage).format(wildcards=wildcards),
        message:
            f"{row.name}: {{params.scene}}{''.join(f' {{wildcards.{name}}}' for name in row.placeholders)}"
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
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.publish {params.key}/key.json results/{wildcards.scene} 2> {log:q}'


# One file by the name under which people open it.
rule one_file:
    input:
        inputs.of_scene_file,
    output:
        "results/{scene}/{file}",
    log:
        "results/{scene}/logs/publish-{file}.log",
    localrule: True
    params:
        source=lambda wildcards: names.file(wildcards.scene, wildcards.file)[0],
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.publish {params.source} {output:q} 2> {log:q}'
