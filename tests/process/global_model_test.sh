#!/usr/bin/env bash
# A global descriptor model that cannot be used ends skein-features at its start, with the reason.
source "$(dirname "$0")/../harness.sh"
enter_network_namespace "$@"
new_workspace

# refuses WORD OPTION...: exit code 2, and WORD and the file's name in what it says
refuses() {
  local word=$1 status=0
  shift
  timeout 60 "$SKEIN_BUILD/bin/skein-features" --session-id 0123456789abcdef --lcm-url memq:// "$@" \
    >"$workspace/out" 2>&1 || status=$?
  ((status == 2)) || fail "$*: exit code $status: $(<"$workspace/out")"
  grep -q -- "$word" "$workspace/out" || fail "$*: no \"$word\" in: $(<"$workspace/out")"
  ! grep -q "^ready" "$workspace/out" || fail "$*: it got ready"
}

echo "not a model" >"$workspace/broken.onnx"
refuses "broken.onnx is no ONNX model" --global-model "$workspace/broken.onnx"
refuses "cannot open .*absent.onnx" --global-model "$workspace/absent.onnx"
echo '{"widht": 6}' >"$workspace/broken.json"
refuses 'broken.json: unknown key "widht"' --global-model "$workspace/broken.onnx"
rm "$workspace/broken.json"
printf 'version https://git-lfs/spec/v1\noid sha256:00\nsize 9\n' >"$workspace/pointer.onnx"
refuses "pointer.onnx is a Git LFS pointer" --global-model "$workspace/pointer.onnx"
refuses "the mean 123.7 is not of pixel / 255" --global-model "$workspace/broken.onnx" --global-mean 123.7 116.3 103.5
printf '[features]\nglobal_model = "%s"\n' "$workspace/broken.onnx" >"$workspace/my.toml"
refuses "broken.onnx is no ONNX model" --config "$workspace/my.toml"
refuses "channel order" --global-model "$workspace/broken.onnx" --global-channels GRB
refuses "exclude each other" --global-model "$workspace/broken.onnx" --codebook "$workspace/any.bin"
refuses "not a codebook" --codebook "$workspace/broken.onnx"
