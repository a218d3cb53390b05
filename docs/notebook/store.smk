# A sketch of results named by what they are made of; docs/notebook/store.md has the reasons. Needs scenes/*.json, code/<stage>.py
# (with a number FACTOR) and a profile with `rerun-triggers: [mtime]` and `rerun-incomplete: true`.
import filecmp, hashlib, json, os, shutil, sys, tempfile, uuid
from functools import cache
from pathlib import Path
STAGES = {"contact": (["surface"], [], "012"), "friction": (["least"], ["contact"], "0"), "oscillator": (["mass"], ["friction"], "0"), "figure5": (["name"], ["oscillator", "friction"], "0")}
STORE = Path("results/store")
def digest(thing): return hashlib.sha256(json.dumps(thing, sort_keys=True).encode()).hexdigest()[:16]
def code(root, stage): return digest(Path(root, "code", f"{stage}.py").read_text())
def replacing(target, write, mode=0o444):
    temporary = target.with_name(f".{target.name}.{uuid.uuid4().hex}")
    target.parent.mkdir(parents=True, exist_ok=True)
    write(temporary)
    if mode: temporary.chmod(mode)
    os.replace(temporary, target)
def link(source, target):
    try: os.link(source, target)
    except OSError: shutil.copy2(source, target)  # no hard links here
def job(root, output):
    """One file of the store; what it is made of stands in key.json, never in the scene."""
    entry = json.loads((output.parent / "key.json").read_text())
    def check():
        if code(root, entry["stage"]) != entry["code"]: sys.exit(f"{entry['stage']}: code changed during the run; nothing is written, run snakemake again")
    check()
    inputs = [Path(file) for file in entry["before"]]  # not those of Snakemake: what exists has none there
    if lost := [file for file in inputs if not file.exists()]: sys.exit(f"{lost[0]}: not there; run snakemake again")
    same = STORE / entry["stage"] / "same" / digest([entry["scene"], entry["code"], output.name, [file.read_text() for file in inputs]])
    if same.exists(): return replacing(output, lambda t: link(same, t))  # early cut-off
    exec((root / "code" / f"{entry['stage']}.py").read_text(), numbers := {})
    text = f"{entry['stage']} {numbers['FACTOR']} {entry['scene']} " + " ".join(file.read_text() for file in inputs)
    check()
    replacing(output, lambda t: t.write_text(text))
    replacing(same, lambda t: link(output, t))
def publish(pairs):
    for path, source in pairs.items():
        if "figure5" in path: replacing(Path(path), lambda t: shutil.copyfile(source, t), 0o644)  # people may save over it
        else: replacing(Path(path), lambda t: link(source, t), None)
# Rules
ROOT = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))
MAIN = workflow.is_main_process  # a job on another machine needs no scene
SCENES = {p.stem: json.loads(p.read_text()) | {"name": p.stem} for p in (ROOT / "scenes").glob("*.json")} if MAIN else {}
DESCRIBES = {"--report", "--dag", "--rulegraph", "--summary"} & set(sys.argv)
STALE = tempfile.NamedTemporaryFile(prefix="stale-")  # newer than any result
PYTHON = f"{sys.executable} -c \"import sys, pathlib; exec(open(sys.argv[1] + '/store.smk').read().split('# Rules')[0]); "
entries = {}
@cache
def key(scene, stage):
    reads, before, _ = STAGES[stage]
    entry = {"stage": stage, "scene": {k: SCENES[scene][k] for k in reads}, "code": code(ROOT, stage), "before": [f for b in before for f in files(scene, b)]}
    entries[stage, digest(entry)] = entry
    return digest(entry)
def files(scene, stage): return [f"{STORE}/{stage}/{key(scene, stage)}/{n}.txt" for n in STAGES[stage][2]]
def entry_of(stage, key): return entries.get((stage, key)) or json.loads((STORE / stage / key / "key.json").read_text())
def before(stage, w):
    """What exists has no inputs: it is what its name says."""
    return [] if (STORE / stage / w.key / f"{w.n}.txt").exists() and not DESCRIBES else entry_of(stage, w.key)["before"]
def published(w):
    pairs = {f"results/{w.scene}/{stage}/{Path(f).name}": f for stage in STAGES for f in files(w.scene, stage)}
    return {p: f for p, f in pairs.items() if not hasattr(w, "file") or p == f"results/{w.scene}/{w.file}"}
def is_current(path, source):
    return os.path.exists(path) and os.path.exists(source) and (os.path.samefile(path, source) or filecmp.cmp(path, source, shallow=False))
def sources(w):
    listed = Path(f"results/{w.scene}/published.json")
    is_listed = hasattr(w, "file") or (listed.exists() and json.loads(listed.read_text()) == published(w))
    return [*published(w).values(), *([] if is_listed and all(is_current(*pair) for pair in published(w).items()) else [STALE.name])]
if MAIN and not DESCRIBES and not workflow.output_settings.dryrun:  # not in onstart, which a module never calls
    for stage, name in [(stage, key(scene, stage)) for scene in SCENES for stage in STAGES]:
        if not (file := STORE / stage / name / "key.json").exists(): replacing(file, lambda t: t.write_text(json.dumps(entries[stage, name])))
wildcard_constraints: key="[0-9a-f]{16}", n="[0-9]", scene="(?!store)[a-z]+", file="(?!published.json).*"
rule all:
    input: [f"results/{scene}/published.json" for scene in SCENES]
for stage in STAGES:
    rule:
        name: stage
        input: lambda w, stage=stage: before(stage, w)
        output: report(f"{STORE}/{stage}/{{key}}/{{n}}.txt", category=lambda w: entry_of("figure5", w.key)["scene"]["name"]) if stage == "figure5" else f"{STORE}/{stage}/{{key}}/{{n}}.txt"
        params: root=ROOT, python=PYTHON
        shell: "{params.python} job(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))\" {params.root} {output}"
for name, output in {"publish": "results/{scene}/published.json", "one_file": "results/{scene}/{file}"}.items():
    rule:
        name: name
        input: sources
        output: output
        params: root=ROOT, python=PYTHON, pairs=lambda w: json.dumps(published(w)), listed=lambda w: "" if hasattr(w, "file") else f"results/{w.scene}/published.json"
        localrule: True
        shell: "{params.python} publish(json.loads(sys.argv[2])); [pathlib.Path(f).write_text(sys.argv[2]) for f in sys.argv[3:] if f]\" {params.root} {params.pairs:q} {params.listed:q}"
