# What shows how fast and how sure the solvers are. None of it is part of a scene.
# In:  the code alone.
# Out: results/benchmarks/<stage>.json|png|svg. `--config peers=true` measures beside public solvers, which must be
#      installed (`make benchmark PEERS=1`), `--config quick=true` on tiny meshes, to show in seconds that all works.
#      results/stress/<stage>.json, and all of them in results/stress.json; a failure of any problem fails the job, and
#      its log tells which. `--config seed=today` for other problems, `--config problems=100` for fewer.
import itertools

from workflow.benchmarks.key import benchmark_key
from workflow.stress.key import stress_key

BENCHMARKS = ("contact",)
STRESSED = ("contact",)
BENCHMARK_OPTIONS = [name for name in ("peers", "quick") if config.get(name)]
BENCHMARK_LOCK = ROOT / "requirements-peers.lock" if "peers" in BENCHMARK_OPTIONS else LOCK
STRESS_OPTIONS = {name: str(config[name]) for name in ("seed", "problems") if name in config}

os.environ["PYTHONPATH"] += os.pathsep + str(ROOT)
EVIDENCE = 'exec "$ROUGHSLIP_PYTHON" -m workflow'


rule benchmark:
    input:
        [f"results/benchmarks/{stage}.{kind}" for stage, kind in itertools.product(BENCHMARKS, ("json", "png", "svg"))],


rule benchmark_contact:
    input:
        key=lambda wildcards: benchmark_key("contact", ROOT, BENCHMARK_LOCK, options=BENCHMARK_OPTIONS),
    output:
        result="results/benchmarks/contact.json",
    log:
        "results/benchmarks/logs/contact.log",
    threads: 1
    params:
        options=" ".join(f"--{name}" for name in BENCHMARK_OPTIONS),
    shell:
        EVIDENCE + ".benchmarks.contact {params.options} --output {output.result:q} 2> {log:q}"


rule benchmark_contact_figure:
    input:
        key=lambda wildcards: benchmark_key("contact_figure", ROOT, LOCK),
        result=rules.benchmark_contact.output.result,
    output:
        png="results/benchmarks/contact.png",
        svg="results/benchmarks/contact.svg",
    log:
        "results/benchmarks/logs/contact_figure.log",
    threads: 1
    shell:
        EVIDENCE
        + ".benchmarks.contact_figure --benchmark {input.result:q} --output {output.png:q} {output.svg:q} 2> {log:q}"


rule stress:
    input:
        campaigns=expand("results/stress/{stage}.json", stage=STRESSED),
    output:
        result="results/stress.json",
    log:
        "results/stress/logs/gather.log",
    threads: 1
    shell:
        EVIDENCE + ".stress.gather --campaigns {input.campaigns:q} --output {output.result:q} 2> {log:q}"


rule stress_contact:
    input:
        key=lambda wildcards: stress_key("contact", ROOT, LOCK, options=STRESS_OPTIONS),
    output:
        result="results/stress/contact.json",
    log:
        "results/stress/logs/contact.log",
    threads: 2
    params:
        options=" ".join(f"--{name} {shlex.quote(value)}" for name, value in STRESS_OPTIONS.items()),
    shell:
        EVIDENCE + ".stress.contact {params.options} -j {threads} --output {output.result:q} 2> {log:q}"
