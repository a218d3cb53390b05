# What a scene is for.
# In:  surface/twins.nc, chaos/square.nc, chaos/field.nc, friction/statistics.nc, oscillator/statistics.nc and deterministic.nc,
#      as far as the scene's targets need them.
# Out: figure2|3|3_law|5|_scan|_field.png|svg|nc, claims.json, costs.json, report.html; for the default scenes together
#      results/report.html. `comparison` draws Figure 3 of several scenes in one picture, results/comparison.png|svg|nc;
#      `--config compare=resolved,mine` says of which.


rule cycles:
    input:
        key=scenes.key("cycles"),
        deterministic=rules.deterministic.output.result,
        ensemble=lambda wildcards: scenes.oscillator_runs(wildcards.scene),
    output:
        result="results/{scene}/oscillator/statistics.nc",
        usage="results/{scene}/usage/cycles.json",
    log:
        "results/{scene}/logs/cycles.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("cycles"),
    shell:
        STAGE + ".cycles --key {input.key:q} --deterministic {input.deterministic:q} --ensemble {input.ensemble:q}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule figure2:
    input:
        key=scenes.key("figure2"),
        result=rules.chaos_square.output.result,
    output:
        numbers="results/{scene}/figure2.nc",
        png=report("results/{scene}/figure2.png", caption="../report/figure2.rst", category="{scene}"),
        svg="results/{scene}/figure2.svg",
        usage="results/{scene}/usage/figure2.json",
    log:
        "results/{scene}/logs/figure2.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("figure2"),
    shell:
        STAGE + ".figure2 --key {input.key:q} --result {input.result:q} --png {output.png:q} --svg {output.svg:q}"
        " --output {output.numbers:q} --usage {output.usage:q} 2> {log:q}"


rule figure3:
    input:
        key=scenes.key("figure3"),
        result=rules.friction.output.result,
    output:
        numbers="results/{scene}/figure3.nc",
        png=report("results/{scene}/figure3.png", caption="../report/figure3.rst", category="{scene}"),
        svg="results/{scene}/figure3.svg",
        usage="results/{scene}/usage/figure3.json",
    log:
        "results/{scene}/logs/figure3.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("figure3"),
    shell:
        STAGE + ".figure3 --key {input.key:q} --result {input.result:q} --png {output.png:q} --svg {output.svg:q}"
        " --output {output.numbers:q} --usage {output.usage:q} 2> {log:q}"


rule figure3_law:
    input:
        key=scenes.key("figure3_law"),
        result=rules.friction.output.result,
    output:
        numbers="results/{scene}/figure3_law.nc",
        png=report("results/{scene}/figure3_law.png", caption="../report/figure3_law.rst", category="{scene}"),
        svg="results/{scene}/figure3_law.svg",
        usage="results/{scene}/usage/figure3_law.json",
    log:
        "results/{scene}/logs/figure3_law.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("figure3_law"),
    shell:
        STAGE + ".figure3_law --key {input.key:q} --result {input.result:q} --png {output.png:q} --svg {output.svg:q}"
        " --output {output.numbers:q} --usage {output.usage:q} 2> {log:q}"


rule figure5:
    input:
        key=scenes.key("figure5"),
        result=rules.cycles.output.result,
    output:
        numbers="results/{scene}/figure5.nc",
        png=report("results/{scene}/figure5.png", caption="../report/figure5.rst", category="{scene}"),
        svg="results/{scene}/figure5.svg",
        usage="results/{scene}/usage/figure5.json",
    log:
        "results/{scene}/logs/figure5.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("figure5"),
    shell:
        STAGE + ".figure5 --key {input.key:q} --result {input.result:q} --png {output.png:q} --svg {output.svg:q}"
        " --output {output.numbers:q} --usage {output.usage:q} 2> {log:q}"


rule figure_scan:
    input:
        key=scenes.key("figure_scan"),
        result=rules.twins.output.result,
    output:
        numbers="results/{scene}/figure_scan.nc",
        png=report("results/{scene}/figure_scan.png", caption="../report/figure_scan.rst", category="{scene}"),
        svg="results/{scene}/figure_scan.svg",
        usage="results/{scene}/usage/figure_scan.json",
    log:
        "results/{scene}/logs/figure_scan.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("figure_scan"),
    shell:
        STAGE + ".figure_scan --key {input.key:q} --result {input.result:q} --png {output.png:q} --svg {output.svg:q}"
        " --output {output.numbers:q} --usage {output.usage:q} 2> {log:q}"


rule figure_field:
    input:
        key=scenes.key("figure_field"),
        result=rules.field_square.output.result,
    output:
        numbers="results/{scene}/figure_field.nc",
        png=report("results/{scene}/figure_field.png", caption="../report/figure_field.rst", category="{scene}"),
        svg="results/{scene}/figure_field.svg",
        usage="results/{scene}/usage/figure_field.json",
    log:
        "results/{scene}/logs/figure_field.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("figure_field"),
    shell:
        STAGE + ".figure_field --key {input.key:q} --result {input.result:q} --png {output.png:q} --svg {output.svg:q}"
        " --output {output.numbers:q} --usage {output.usage:q} 2> {log:q}"


rule claims:
    input:
        key=scenes.key("claims"),
        results=lambda wildcards: list(scenes.results(wildcards.scene).values()),
    output:
        result="results/{scene}/claims.json",
        usage="results/{scene}/usage/claims.json",
    log:
        "results/{scene}/logs/claims.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("claims"),
    params:
        results=lambda wildcards: " ".join(
            f"--{option} {shlex.quote(path)}" for option, path in scenes.results(wildcards.scene).items()
        ),
    shell:
        STAGE + ".claims --key {input.key:q} {params.results}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule costs:
    input:
        key=scenes.key("costs"),
        records=lambda wildcards: scenes.usage_records(wildcards.scene),
    output:
        result="results/{scene}/costs.json",
        usage="results/{scene}/usage/costs.json",
    log:
        "results/{scene}/logs/costs.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("costs"),
    shell:
        STAGE + ".costs --key {input.key:q} --records {input.records:q}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule scene_report:
    input:
        key=scenes.key("report"),
        claims=rules.claims.output.result,
        costs=rules.costs.output.result,
        figures=lambda wildcards: scenes.figures(wildcards.scene),
        surfaces=lambda wildcards: scenes.surfaces(wildcards.scene),
    output:
        result="results/{scene}/report.html",
        usage="results/{scene}/usage/report.json",
    log:
        "results/{scene}/logs/report.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("report"),
    shell:
        STAGE + ".report --key {input.key:q} --scenes results/{wildcards.scene}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule report_of_the_default_scenes:
    input:
        key=lambda wildcards: scenes.key_file(scenes.default[0], "report"),
        scenes=[f"results/{name}/report.html" for name in scenes.default],
        kept=kept_evidence(),
        drawn=[f"results/evidence/{Path(file).stem}.png" for file in kept_evidence() if Path(file).stem in BENCHMARKS],
    output:
        result="results/report.html",
        usage="results/usage/report.json",
    log:
        "results/logs/report.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("report"),
    params:
        folders=" ".join(f"results/{name}" for name in scenes.default),
        evidence="--evidence results/reference/evidence --drawn results/evidence" if kept_evidence() else "",
    shell:
        STAGE + ".report --key {input.key:q} --scenes {params.folders} {params.evidence}"
        " --output {output.result:q} --usage {output.usage:q} 2> {log:q}"


rule comparison:
    input:
        key=lambda wildcards: scenes.key_file(compared[0], "comparison"),
        figures=[f"results/{name}/figure3.nc" for name in compared],
    output:
        numbers="results/comparison.nc",
        png=report("results/comparison.png", caption="../report/comparison.rst", category="comparison"),
        svg="results/comparison.svg",
        usage="results/usage/comparison.json",
    log:
        "results/logs/comparison.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("figure3"),
    params:
        folders=" ".join(f"results/{name}" for name in compared),
    shell:
        STAGE + ".comparison --key {input.key:q} --scenes {params.folders} --png {output.png:q} --svg {output.svg:q}"
        " --output {output.numbers:q} --usage {output.usage:q} 2> {log:q}"


rule verify:
    input:
        key=lambda wildcards: scenes.key_file(scenes.default[0], "verify"),
        scenes=[f"results/{name}/{file}" for name in scenes.default for file in ("claims.json", "summary.csv")],
        friction=[f"results/{name}/friction/statistics.nc" for name in scenes.default],
    output:
        result="results/verify.json",
        text="results/verify.txt",
        usage="results/usage/verify.json",
    log:
        "results/logs/verify.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("verify"),
    params:
        folders=" ".join(f"results/{name}" for name in scenes.default),
        reference=ROOT / "results" / "reference",
    shell:
        STAGE + ".verify --key {input.key:q} --scenes {params.folders} --reference {params.reference:q}"
        " --output {output.result:q} --text {output.text:q} --usage {output.usage:q} 2> {log:q}"


rule reference:
    input:
        key=lambda wildcards: scenes.key_file(scenes.default[0], "reference"),
        scenes=[f"results/{name}/report.html" for name in scenes.default],
        pressure=missing(scenes.default),
    output:
        usage=temp("results/.reference-usage.json"),
    log:
        "results/logs/reference.log",
    threads: 1
    resources:
        mem_mb=scenes.memory("reference"),
    params:
        folders=" ".join(f"results/{name}" for name in scenes.default),
    shell:
        STAGE + ".reference --key {input.key:q} --scenes {params.folders} --output results/reference"
        " --usage {output.usage:q} 2> {log:q}"
