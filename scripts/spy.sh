#!/usr/bin/env bash
# lcm-spy with Skein's messages decoded (double-click a channel to see the fields).
#
#   scripts/spy.sh [--lcm-url URL] [--build DIR]
#
# launch.sh and reconstruct.sh print the URL of their session: for an encrypted one (tcpqs://), that of the
# port for listening on its host. Needs a display.
source "$(dirname "$0")/lib.sh"

url=${LCM_DEFAULT_URL:-udpm://239.255.76.67:7667?ttl=0}
while (($#)); do
  case $1 in
    -h | --help) print_help; exit 0 ;;
    --lcm-url | --build) (($# > 1)) || usage_error "$1 needs a value" ;;&
    --lcm-url) url=$2; shift ;;
    --build) SKEIN_BUILD=$2; shift ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift
done
[[ $url != tcpqs:* ]] || die "lcm-spy has no TLS: take the tcpq://127.0.0.1 URL of launch.sh's \"watch:\" line, on its host"
[[ -n ${DISPLAY:-} ]] || die "no display: set DISPLAY (ssh -X sets it)"
exec_lcm_spy "$url"
