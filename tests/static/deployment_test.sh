#!/usr/bin/env bash
# The image's Containerfile, packaging/compose.yaml and the manifests of packaging/kubernetes name images, ports, paths, options and
# metrics that exist, and agree. kubectl renders the manifests where it is installed. No cluster has run them.
source "$(dirname "$0")/../harness.sh"
python3 -c 'import yaml' 2>/dev/null || skip "no python3-yaml (scripts/setup.sh --tests installs it)"
"$SKEIN_ROOT/tests/static/deployment.py" "$SKEIN_ROOT" || fail "mend the files above"
if command -v kubectl >/dev/null; then
  kubectl kustomize "$SKEIN_ROOT/packaging/kubernetes" >/dev/null || fail "kubectl cannot read packaging/kubernetes"
else
  echo "no kubectl: the kustomization is not rendered"
fi
