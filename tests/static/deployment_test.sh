#!/usr/bin/env bash
# The image's Containerfile, packaging/compose.yaml and the manifests of packaging/kubernetes name images, ports, paths, options and
# metrics that exist, and agree. No cluster has run the manifests.
source "$(dirname "$0")/../harness.sh"
python3 -c 'import yaml' 2>/dev/null || skip "no python3-yaml (scripts/setup.sh --tests installs it)"
"$SKEIN_ROOT/tests/static/deployment.py" "$SKEIN_ROOT" || fail "mend the files above"
