#!/usr/bin/env bash
# Steps of the Action (action.yml): install, run, compare with a release, write summary and comment. Reads ENGINE, SCENES,
# BASE, FAIL_ON and EXTRAS; writes crosscheck-out/. Exits with 1 if rows are alarming or what FAIL_ON names has changed,
# with 4 if the base does not answer.
set -uo pipefail

out=crosscheck-out
read -ra scenes <<< "${SCENES:-}"
summary=${GITHUB_STEP_SUMMARY:-/dev/stdout}

if ! command -v crosscheck >/dev/null; then
  python -m pip install --quiet "${GITHUB_ACTION_PATH:?}[${EXTRAS:-report}]" || exit 2
fi

status=0
crosscheck run "${scenes[@]}" --standard --engine "${ENGINE:?}" --out "$out" --junit "$out.xml" --markdown "$out.md" || status=$?
# 1 is a verdict and goes on to the comparison; anything else means that there is nothing to compare.
[ "$status" -le 1 ] || exit "$status"
mv "$out.xml" "$out/junit.xml"
mv "$out.md" "$out/summary.md"

: > "$out/comment.md"
if [ -n "${BASE:-}" ]; then
  # A base that does not answer (4) is nothing to compare with: green would say that nothing changed.
  crosscheck releases "$ENGINE" "$BASE" "${scenes[@]}" --out "$out" --json > "$out/base.json" || exit $?
  released=$(python -c 'import json, sys; print(json.load(open(sys.argv[1]))["releases"][0]["release"])' "$out/base.json") || exit 2
  changed=0
  crosscheck compare "$released" latest --markdown --fail-on "${FAIL_ON:-regressions}" --out "$out" > "$out/comment.md" || changed=$?
  [ "$changed" -le 1 ] || exit "$changed"
  [ "$changed" -eq 0 ] || status=1
fi
crosscheck report --out "$out" > /dev/null || echo "no report: pip install 'contact-crosscheck[report]'"

cat "$out/comment.md" "$out/summary.md" >> "$summary"
[ -z "${GITHUB_OUTPUT:-}" ] || echo "comment=$out/comment.md" >> "$GITHUB_OUTPUT"
exit "$status"
