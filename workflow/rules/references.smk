# Monte Carlo references of the pressure at the centre, which git keeps; a run of the study never makes them.
# In:  key files without a hash of the code (workflow/lib/references.py says why).
# Out: results/<scene>/pressure_solves/<first>-<last>.nc, results/reference/<scene>/pressure.nc. `make reference` makes it
#      where it is missing, as `--config reference_surfaces=40000` of fewer surfaces. An interrupted run is resumed, and
#      batches made elsewhere count, if they are younger than their key.
from workflow.lib.references import SURFACES, missing, solves, solves_key

REFERENCE_SURFACES = int(config["reference_surfaces"]) if "reference_surfaces" in config else None


rule pressure_solves:
    input:
        key=lambda wildcards: solves_key(wildcards.scene, scenes[wildcards.scene]),
    output:
        result="results/{scene}/pressure_solves/{first}-{last}.nc",
    log:
        "results/{scene}/logs/pressure_solves-{first}-{last}.log",
    wildcard_constraints:
        scene="|".join(SURFACES),
    threads: 1
    resources:
        mem_mb=scenes.memory("contact_square"),
    shell:
        EVIDENCE + ".references.pressure_solves --key {input.key:q} --first {wildcards.first} --last {wildcards.last}"
        " --output {output.result:q} 2> {log:q}"


rule pressure_reference:
    input:
        key=lambda wildcards: solves_key(wildcards.scene, scenes[wildcards.scene]),
        solves=lambda wildcards: solves(wildcards.scene, REFERENCE_SURFACES),
    output:
        result="results/reference/{scene}/pressure.nc",
    log:
        "results/{scene}/logs/pressure_reference.log",
    wildcard_constraints:
        scene="|".join(SURFACES),
    threads: 1
    resources:
        mem_mb=scenes.memory("contact_square"),
    shell:
        EVIDENCE
        + ".references.pressure --key {input.key:q} --solves {input.solves:q} --output {output.result:q} 2> {log:q}"
