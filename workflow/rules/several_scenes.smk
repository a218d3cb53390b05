# What takes several scenes together; each is asked for by name.
# In:  results of the default scenes, or of those that `--config compare=resolved,mine` names; the kept results.
# Out: results/report.html; results/comparison.png|svg|nc, figures of several scenes in one picture; results/verify.json|txt;
#      results/reference, the small results that git keeps. `clean_unused` removes what no scene uses.
JOINT_FILES = ("report.html", *declarations()["comparison"].results.values())
DRAWN = [f"results/evidence/{file.stem}.svg" for file in KEPT_EVIDENCE if file.stem in BENCHMARKS]


def joint_file(file):
    """The file of the store, of the page on the default scenes or of a comparison."""
    if file.endswith(".html"):
        entry = names.joint_page(scenes.default, KEPT_EVIDENCE, DRAWN, [ROOT / "workflow/benchmarks/plot.py"])
    else:
        entry = names.comparison(compared)
    return f"{entry.folder}/{file}"


def over_published(stage, **inputs):
    """Key file of a stage that reads the published results of the default scenes."""
    folders = [f"results/{name}" for name in scenes.default]
    files = {option: f"results/{file or stage}" for option, file in declarations()[stage].results.items()}
    return f"{names.over_published(stage, files, scenes=folders, **inputs).folder}/key.json"


PUBLISHED = [f"results/{name}/{LISTED}" for name in scenes.default]


rule joint_file:
    input:
        lambda wildcards: one_file(f"results/{wildcards.joint}", joint_file(wildcards.joint)),
    output:
        "results/{joint}",
    log:
        "results/logs/publish-{joint}.log",
    wildcard_constraints:
        joint="|".join(JOINT_FILES),
    localrule: True
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.job study.publish {input[0]:q} {output:q} 2> {log:q}'


rule comparison:
    input:
        [f"results/{file}" for file in declarations()["comparison"].results.values()],


rule verify:
    input:
        PUBLISHED,
    output:
        **{option: f"results/{file}" for option, file in declarations()["verify"].results.items()},
    log:
        "results/logs/verify.log",
    localrule: True
    params:
        key=lambda wildcards: over_published("verify", reference=[str(ROOT / "results" / "reference")]),
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m roughslip.stages.verify --key {params.key} 2> {log:q}'


rule reference:
    input:
        PUBLISHED,
        missing(scenes.default),
    log:
        "results/logs/reference.log",
    localrule: True
    params:
        key=lambda wildcards: over_published("reference"),
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m roughslip.stages.reference --key {params.key} 2> {log:q}'


rule clean_unused:
    log:
        "results/logs/clean_unused.log",
    localrule: True
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.job study.unused 2> {log:q}'
