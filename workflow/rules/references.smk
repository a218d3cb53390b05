# Monte Carlo references of the pressure at the centre and of the friction of windows, which git keeps; a run of the
# study never makes them.
# In:  key files without a hash of the code (workflow/keys/monte_carlo_batches.py says why).
# Out: results/store/<kind>_solves/<key>/<first>-<last>.nc, results/reference/<scene>/<kind>.nc. `make reference` makes it
#      where it is missing, as `--config reference_surfaces=40000 reference_strips=1000` of fewer samples. An interrupted
#      run is resumed, and batches made elsewhere count.
from workflow.keys.monte_carlo_batches import SAMPLES, missing

FEWER = {"pressure": "reference_surfaces", "friction": "reference_strips"}
REFERENCE_SAMPLES = {kind: options[option] for kind, option in FEWER.items()}


for kind in SAMPLES:

    rule:
        name:
            f"{kind}_solves"
        output:
            result=f"{STORE}/{kind}_solves/{{key}}/{{first}}-{{last}}.nc",
        log:
            f"{STORE}/{kind}_solves/{{key}}/logs/{{first}}-{{last}}.log",
        resources:
            mem_mb=1000,
        params:
            kind=kind,
            key=f"{STORE}/{kind}_solves/{{key}}/key.json",
        shell:
            'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
            " monte_carlo.{params.kind} solve --key {params.key} --first {wildcards.first}"
            " --last {wildcards.last} --output {output.result:q} 2> {log:q}"

    rule:
        name:
            f"{kind}_reference"
        input:
            solves=lambda wildcards, kind=kind: names.solved(wildcards.scene, kind, REFERENCE_SAMPLES[kind]),
        output:
            result=f"results/reference/{{scene}}/{kind}.nc",
        log:
            f"results/{{scene}}/logs/{kind}_reference.log",
        wildcard_constraints:
            scene="|".join(SAMPLES[kind]),
        resources:
            mem_mb=1000,
        params:
            kind=kind,
            key=lambda wildcards, kind=kind: f"{names.solves(wildcards.scene, kind).folder}/key.json",
        shell:
            'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
            " monte_carlo.{params.kind} gather --key {params.key} --solves {input.solves:q} --output {output.result:q} 2> {log:q}"
