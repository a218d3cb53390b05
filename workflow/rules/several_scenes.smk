# What takes several scenes together; each is asked for by name.
# In:  results of the default scenes; the kept results.
# Out: results/report.html; results/verify.json|txt; results/reference, the small results that git keeps;
#      results/scatter_law/law.json, the law of scatter against solved cells. `clean_unused` removes what no
#      scene uses.
KEPT_EVIDENCE = sorted(Path("results/reference/evidence").glob("*"))  # by `make benchmark` and `make stress`
PUBLISHED = [f"results/{name}/{LISTED}" for name in scenes.default]


rule joint_page:
    input:
        unpack(
            lambda _: inputs.of_file(
                "results/report.html", f"{names.joint_page(scenes.default, KEPT_EVIDENCE).folder}/report.html"
            )
        ),
    output:
        "results/report.html",
    log:
        "results/logs/publish-report.log",
    localrule: True
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.publish {input.source:q} {output:q} 2> {log:q}'


rule verify:
    input:
        PUBLISHED,
    output:
        **{option: f"results/{file}" for option, file in declarations()["verify"].results.items()},
    log:
        "results/logs/verify.log",
    localrule: True
    params:
        folder=lambda wildcards: names.over_published(
            "verify", scenes.default, reference=[str(ROOT / "results" / "reference")]
        ).folder,
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m roughslip.stages verify --key {params.folder}/key.json 2> {log:q}'


rule reference:
    input:
        PUBLISHED,
    log:
        "results/logs/reference.log",
    localrule: True
    params:
        folder=lambda wildcards: names.over_published("reference", scenes.default).folder,
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m roughslip.stages reference --key {params.folder}/key.json 2> {log:q}'


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
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.unused {params.own:q} 2> {log:q}'
