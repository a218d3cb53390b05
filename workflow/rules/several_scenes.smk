# What takes several scenes together; each is asked for by name.
# In:  products of the default scenes, or of those that `--config compare=resolved,mine` names; the kept results.
# Out: results/report.html; results/comparison.png|svg|nc, figures of several scenes in one picture; results/verify.json|txt;
#      results/reference, the small results that git keeps. `clean_unused` removes what no scene uses.
DEFAULT_FOLDERS = " ".join(f"results/{name}" for name in scenes.default)


rule report_of_the_default_scenes:
    input:
        key=lambda wildcards: scenes.key_file(scenes.default[0], "report"),
        scenes=[f"results/{name}/report.html" for name in scenes.default],
        kept=KEPT_EVIDENCE,
        drawn=[f"results/evidence/{file.stem}.svg" for file in KEPT_EVIDENCE if file.stem in BENCHMARKS],
    output:
        **outputs("report", "results"),
    log:
        log("report", "results"),
    resources:
        mem_mb=scenes.memory("report"),
    params:
        evidence=lambda wildcards, input: str(Path(input.kept[0]).parent) if input.kept else "",
        drawn=lambda wildcards, input: str(Path(input.drawn[0]).parent) if input.drawn else "",
    shell:
        run("report", scenes=DEFAULT_FOLDERS, evidence="{params.evidence}", drawn="{params.drawn}")


rule comparison:
    input:
        key=lambda wildcards: scenes.key_file(next(iter(compared)), "comparison"),
        results=[f"results/{name}/{figure}.nc" for name, figures in compared.items() for figure in figures],
    output:
        **outputs("comparison", "results"),
    log:
        log("comparison", "results"),
    resources:
        mem_mb=scenes.memory("comparison"),
    params:
        caption=declarations()["comparison"].caption,
    shell:
        run("comparison")


rule verify:
    input:
        key=lambda wildcards: scenes.key_file(scenes.default[0], "verify"),
        scenes=[f"results/{name}/{file}" for name in scenes.default for file in ("claims.json", "summary.csv")],
        friction=[f"results/{name}/friction/statistics.nc" for name in scenes.default],
    output:
        **outputs("verify", "results"),
    log:
        log("verify", "results"),
    resources:
        mem_mb=scenes.memory("verify"),
    params:
        reference=ROOT / "results" / "reference",
    shell:
        run("verify", scenes=DEFAULT_FOLDERS, reference="{params.reference:q}")


rule reference:
    input:
        key=lambda wildcards: scenes.key_file(scenes.default[0], "reference"),
        scenes=[f"results/{name}/report.html" for name in scenes.default],
        pressure=missing(scenes.default),
    output:
        usage=temp("results/.reference-usage.json"),
    log:
        log("reference", "results"),
    resources:
        mem_mb=scenes.memory("reference"),
    shell:
        run("reference", scenes=DEFAULT_FOLDERS, output="results/reference")


# Variants of a scene, in one table. The scene itself is the first row.
rule sweep:
    input:
        key=scenes.key("sweep"),
        scenes=lambda wildcards: [
            f"results/{name}/report.html" for name in (wildcards.scene, *scenes.variants[wildcards.scene])
        ],
    output:
        **outputs("sweep"),
    log:
        log("sweep"),
    resources:
        mem_mb=scenes.memory("sweep"),
    params:
        folders=lambda wildcards: [f"results/{name}" for name in (wildcards.scene, *scenes.variants[wildcards.scene])],
    shell:
        run("sweep", scenes="{params.folders}")


# What a scene takes from others: hard links, made in seconds. workflow/study/sharing.py says when.
for name, own in shared.items():

    rule:
        name:
            f"{name}{SHARED}"
        input:
            own.awaited,
        output:
            own.made,
        log:
            f"results/{name}/logs/shared.log",
        localrule: True
        params:
            scene=name,
            records=own.records,
        shell:
            'exec "$ROUGHSLIP_PYTHON" -m workflow.job study.share --scene {params.scene} --records {params.records:q} 2> {log:q}'


rule clean_unused:
    log:
        "results/logs/clean_unused.log",
    localrule: True
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.job study.unused 2> {log:q}'
