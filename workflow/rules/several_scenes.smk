# What takes several scenes together; each is asked for by name.
# In:  results of the default scenes; the kept results.
# Out: results/report.html; results/evidence/<subject>.svg, pictures of the kept benchmarks; results/verify.json|txt;
#      results/reference, the small results that git keeps; results/scatter_law/law.json|png|svg, the law of scatter against solved cells. `clean_unused` removes what no
#      scene uses.
KEPT_EVIDENCE = sorted(Path("results/reference/evidence").glob("*.json"))  # by `make benchmark` and `make stress`
DRAWN = [f"results/evidence/{file.stem}.svg" for file in KEPT_EVIDENCE if file.stem in BENCHMARKS]
PLOT = ROOT / "workflow/benchmarks/plot.py"
# By published file, a function of its name in the store.
JOINT = {
    "report.html": lambda: f"{names.joint_page(scenes.default, KEPT_EVIDENCE, DRAWN, [PLOT]).folder}/report.html"
}
PUBLISHED = [f"results/{name}/{LISTED}" for name in scenes.default]


rule joint_file:
    input:
        unpack(lambda wildcards: inputs.of_file(f"results/{wildcards.joint}", JOINT[wildcards.joint]())),
    output:
        "results/{joint}",
    log:
        "results/logs/publish-{joint}.log",
    wildcard_constraints:
        joint="|".join(JOINT),
    localrule: True
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.publish {input.source:q} {output:q} 2> {log:q}'


rule evidence_drawn:
    input:
        code=PLOT,
        result="results/reference/evidence/{subject}.json",
    output:
        svg="results/evidence/{subject}.svg",
        usage="results/evidence/usage/{subject}.json",
    log:
        "results/evidence/logs/{subject}.log",
    wildcard_constraints:
        subject="|".join(BENCHMARKS),
    resources:
        mem_mb=1000,
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.benchmarks.plot --benchmark {input.result:q} --output {output.svg:q}'
        " --usage {output.usage:q} 2> {log:q}"


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
        **{kind: f"results/scatter_law/law.{kind}" for kind in ("json", "png", "svg")},
    log:
        "results/logs/scatter_law.log",
    resources:
        mem_mb=1000,
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.scatter_law --output results/scatter_law > {log:q} 2>&1'


rule clean_unused:
    log:
        "results/logs/clean_unused.log",
    localrule: True
    params:
        own=[config["scenes_folder"]] if "scenes_folder" in config else [],
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.study.unused {params.own:q} 2> {log:q}'
