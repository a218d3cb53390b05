# Monte Carlo references of the pressure at the centre and of the friction of windows, which git keeps; a run of the
# study never makes them.
# In:  key files without a hash of the code (workflow/keys/monte_carlo_batches.py says why).
# Out: results/<scene>/<kind>_solves/<first>-<last>.nc, results/reference/<scene>/<kind>.nc. `make reference` makes it
#      where it is missing, as `--config reference_surfaces=40000 reference_strips=1000` of fewer samples. An interrupted
#      run is resumed, and batches made elsewhere count, if they are younger than their key.
from workflow.keys.monte_carlo_batches import SAMPLES, missing, solves, solves_key

FEWER = {"pressure": "reference_surfaces", "friction": "reference_strips"}
REFERENCE_SAMPLES = {kind: options[option] for kind, option in FEWER.items()}


for kind in SAMPLES:

    rule:
        name:
            f"{kind}_solves"
        input:
            key=lambda wildcards, kind=kind: solves_key(wildcards.scene, scenes[wildcards.scene], kind),
        output:
            result=f"results/{{scene}}/{kind}_solves/{{first}}-{{last}}.nc",
        log:
            f"results/{{scene}}/logs/{kind}_solves-{{first}}-{{last}}.log",
        wildcard_constraints:
            scene="|".join(SAMPLES[kind]),
        resources:
            mem_mb=scenes.memory({"pressure": "contact_square", "friction": "contact_strip"}[kind]),
        params:
            kind=kind,
        shell:
            'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
            " monte_carlo.{params.kind} solve --key {input.key:q} --first {wildcards.first}"
            " --last {wildcards.last} --output {output.result:q} 2> {log:q}"

    rule:
        name:
            f"{kind}_reference"
        input:
            key=lambda wildcards, kind=kind: solves_key(wildcards.scene, scenes[wildcards.scene], kind),
            solves=lambda wildcards, kind=kind: solves(wildcards.scene, kind, REFERENCE_SAMPLES.get(kind)),
        output:
            result=f"results/reference/{{scene}}/{kind}.nc",
        log:
            f"results/{{scene}}/logs/{kind}_reference.log",
        wildcard_constraints:
            scene="|".join(SAMPLES[kind]),
        resources:
            mem_mb=scenes.memory({"pressure": "contact_square", "friction": "contact_strip"}[kind]),
        params:
            kind=kind,
        shell:
            'exec "$ROUGHSLIP_PYTHON" -m workflow.job'
            " monte_carlo.{params.kind} gather --key {input.key:q} --solves {input.solves:q} --output {output.result:q} 2> {log:q}"
