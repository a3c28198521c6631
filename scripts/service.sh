#!/usr/bin/env bash
# Runs a session as a service (skein@.service of the package): launch.sh with the config file if there is one,
# and on an LCM URL that no other session of this host uses.
#
#   scripts/service.sh SESSION CONFIG [launch.sh's options...]
#
# Exit codes: those of launch.sh.
source "$(dirname "$0")/lib.sh"

(($# >= 2)) || { [[ ${1:-} =~ ^(-h|--help)$ ]] && { print_help; exit 0; }; usage_error "give SESSION and CONFIG"; }
session=$1 config=$2
shift 2
options=(--session "$session")
[[ ! -e $config ]] || options+=(--config "$config")
[[ " $* " == *" --lcm-url "* ]] || options+=(--lcm-url "$(private_lcm_url "$session")")
exec "$SKEIN_ROOT/scripts/launch.sh" "${options[@]}" "$@"
