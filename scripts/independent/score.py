"""`python3 scripts/independent/score.py OUT REPORTS`: what the reports (REPORTS/NAME/report.json) say against the truths of OUT.

Wrong: an id, with all that it cannot be told from, that the recording does not hold. Hit: a planted effect's name, or what is as good.
"""
import glob, json, os, sys

out, reports = sys.argv[1:3]
cases = wrong = effects = hits = 0
for path in sorted(glob.glob(f'{reports}/*/report.json')):
    name = os.path.basename(os.path.dirname(path))
    with open(path) as file:
        report = json.load(file)
    with open(f'{out}/truth/{name}.json') as file:
        truth = json.load(file)
    said = [[effect['id'], *(effect.get('indistinguishable_from') or [])] for effect in report['effects']]
    good = [{effect['id'], *(effect.get('accept') or [])} for effect in truth['effects']]
    may = set(truth['true_ids']).union(*good)
    bad = [ids for ids in said if not may.intersection(ids)]
    hit = sum(any(accept.intersection(ids) for ids in said) for accept in good)
    unnamed = [thing['behaves_like'] for thing in report['unexplained']]
    print(name, report['verdict'], 'effects', hit, 'of', len(good), 'WRONG ' + str(bad) if bad else '', 'unnamed', unnamed)
    cases, wrong, effects, hits = cases + 1, wrong + bool(bad), effects + len(good), hits + hit
print(f'{cases} cases, {wrong} with a wrong name, {hits} of {effects} effects named')
