# Pictures of the kept benchmarks, for the joint page. What is kept was measured by `make benchmark` and `make stress`,
# which are no part of a scene and no rule: they run whenever they are asked for.
# In:  results/reference/evidence/<subject>.json.
# Out: results/evidence/<subject>.svg.
from workflow.study.scenes import BENCHMARKS

KEPT_EVIDENCE = sorted(Path("results/reference/evidence").glob("*.json"))


rule evidence_drawn:
    input:
        code=ROOT / "workflow/benchmarks/plot.py",
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
        'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
        " benchmarks.plot --benchmark {input.result:q} --output {output.svg:q}"
        " --usage {output.usage:q} 2> {log:q}"
