# What takes several scenes together; each is asked for by name.
# In:  results of the default scenes; the kept results.
# Out: results/report.html; results/verify.txt; results/scatter_law/law.json, the law of scatter against solved
#      cells. `clean_unused` removes what no scene uses.
KEPT = ROOT / "results" / "reference"
PUBLISHED = [f"results/{name}/{LISTED}" for name in scenes.default]


rule page_of_scenes:
    input:
        lambda _: inputs.of_joint_page(names.joint_page(scenes.default).folder),
    output:
        "results/report.html",
    log:
        "results/logs/publish-report.log",
    localrule: True
    params:
        source=lambda _: f"{names.joint_page(scenes.default).folder}/report.html",
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.publish {params.source} {output:q} 2> {log:q}'


rule verify:
    input:
        PUBLISHED,
    output:
        "results/verify.txt",
    log:
        "results/logs/verify.log",
    localrule: True
    params:
        folder=lambda _: names.comparison(scenes.default, KEPT).folder,
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m roughslip.study --key {params.folder}/key.json 2> {log:q}'


rule scatter_law:
    input:
        code=[ROOT / "workflow/scatter_law.py", ROOT / "src/roughslip/friction/scatter_law.py"],
    output:
        "results/scatter_law/law.json",
    log:
        "results/logs/scatter_law.log",
    resources:
        mem_mb=1000,
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.scatter_law {output:q} > {log:q} 2>&1'


rule clean_unused:
    log:
        "results/logs/clean_unused.log",
    localrule: True
    params:
        own=[config["scenes_folder"]] if "scenes_folder" in config else [],
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.working_folder {params.own:q} 2> {log:q}'
