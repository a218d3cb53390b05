# Benchmarks and stress campaigns of the solvers. They are no part of a scene.
# In:  the code alone.
# Out: results/benchmarks/<stage>.json|png|svg. `--config peers=true` includes public solvers, which must be installed
#      (`make benchmark PEERS=1`). `--config quick=true` measures small problems, a check that takes minutes.
#      results/stress/<stage>.json, and all of them in results/stress.json. The failure of a problem fails the job, and
#      its log names the problem. `--config seed=today` draws other problems, `problems=100` fewer, `share=0.1` a tenth.
import itertools

from workflow.keys.evidence_keys import evidence_key, kept_evidence, measured_scenes
from workflow.study.scenes import BENCHMARKS, STRESSED

BENCHMARK_OPTIONS = [name for name in ("peers", "quick") if config.get(name)]
BENCHMARK_LOCK = ROOT / "requirements-peers.lock" if "peers" in BENCHMARK_OPTIONS else LOCK
EVIDENCE_MB = 4000  # a process
STRESS_OPTIONS = {name: str(config[name]) for name in ("seed", "problems", "share") if name in config}


rule benchmark:
    input:
        [f"results/benchmarks/{stage}.{kind}" for stage, kind in itertools.product(BENCHMARKS, ("json", "png", "svg"))],


for stage in BENCHMARKS:

    rule:
        name:
            f"benchmark_{stage}"
        input:
            key=lambda wildcards, stage=stage: evidence_key(
                "benchmarks",
                stage,
                ROOT,
                BENCHMARK_LOCK,
                options=BENCHMARK_OPTIONS,
                **measured_scenes(stage, scenes.valid),
            ),
        output:
            result=f"results/benchmarks/{stage}.json",
        log:
            f"results/benchmarks/logs/{stage}.log",
        resources:
            mem_mb=EVIDENCE_MB,
        params:
            module=stage,
            options=" ".join(f"--{name}" for name in BENCHMARK_OPTIONS),
        shell:
            'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
            " benchmarks.{params.module} {params.options} --output {output.result:q} 2> {log:q}"

    rule:
        name:
            f"benchmark_{stage}_figure"
        input:
            key=lambda wildcards, stage=stage: evidence_key("benchmarks", "plot", ROOT, LOCK),
            result=f"results/benchmarks/{stage}.json",
        output:
            png=f"results/benchmarks/{stage}.png",
            svg=f"results/benchmarks/{stage}.svg",
            usage=f"results/benchmarks/usage/{stage}_figure.json",
        log:
            f"results/benchmarks/logs/{stage}_figure.log",
        resources:
            mem_mb=EVIDENCE_MB,
        shell:
            'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
            " benchmarks.plot --benchmark {input.result:q} --output {output.png:q} {output.svg:q}"
            " --usage {output.usage:q} 2> {log:q}"


rule evidence_drawn:
    input:
        key=lambda wildcards: evidence_key("benchmarks", "plot", ROOT, LOCK),
        result=lambda wildcards: kept_evidence(wildcards.stage),
    output:
        svg="results/evidence/{stage}.svg",
        usage="results/evidence/usage/{stage}.json",
    log:
        "results/evidence/logs/{stage}.log",
    wildcard_constraints:
        stage="|".join(BENCHMARKS),
    resources:
        mem_mb=EVIDENCE_MB,
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
        " benchmarks.plot --benchmark {input.result:q} --output {output.svg:q}"
        " --usage {output.usage:q} 2> {log:q}"


rule stress:
    input:
        campaigns=expand("results/stress/{stage}.json", stage=STRESSED),
    output:
        result="results/stress.json",
    log:
        "results/stress/logs/gather.log",
    resources:
        mem_mb=EVIDENCE_MB,
    shell:
        'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
        " stress.runner --campaigns {input.campaigns:q} --output {output.result:q} 2> {log:q}"


for stage in STRESSED:

    rule:
        name:
            f"stress_{stage}"
        input:
            key=lambda wildcards, stage=stage: evidence_key("stress", stage, ROOT, LOCK, options=STRESS_OPTIONS),
        output:
            result=f"results/stress/{stage}.json",
        log:
            f"results/stress/logs/{stage}.log",
        threads: 2
        resources:
            mem_mb=2 * EVIDENCE_MB,
        params:
            module=stage,
            options=" ".join(f"--{name} {shlex.quote(value)}" for name, value in STRESS_OPTIONS.items()),
        shell:
            'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
            " stress.{params.module} {params.options} -j {threads} --output {output.result:q} 2> {log:q}"
