#!/usr/bin/env bash
# The stock lcm-spy, with our jar on its class path, decodes a heartbeat of a running service, signed as each message is.
source "$(dirname "$0")/../harness.sh"
command -v Xvfb >/dev/null || skip "no Xvfb (scripts/setup.sh --tests installs it)"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
new_workspace
mkdir "$workspace/session"
url=$(test_lcm_url)

javac -d "$workspace/classes" -cp "$(lcm_spy_class_path)" "$SKEIN_ROOT/tests/spy/SpyCheck.java"
"$SKEIN_BUILD/bin/skein-matching" --session "$workspace/session" --lcm-url "$url" --auth require --instance matching-1 &
class_path=$(lcm_spy_class_path "$workspace/classes")
xvfb-run -a -s '-screen 0 1500x800x24' java -Djava.net.preferIPv4Stack=true -cp "$class_path" \
  lcm.spy.SpyCheck "$url" SKEIN_HEARTBEAT skein.heartbeat_t instance matching-1 60 "$workspace/screen.png" ||
  fail "lcm-spy does not decode SKEIN_HEARTBEAT"
