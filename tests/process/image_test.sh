#!/usr/bin/env bash
# scripts/image.sh packs a root into the same image twice, scripts/test_image.sh runs it as packaging/compose.yaml says, and a session
# comes up as the pod of packaging/kubernetes. The root has launch.sh, the programs that it calls, and stand-ins for Skein's own;
# scripts/image.sh --test runs the package's.
source "$(dirname "$0")/../harness.sh"
((EUID == 0)) || skip "root is needed to change the root"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
python3 -c 'import yaml' 2>/dev/null || skip "no python3-yaml (scripts/setup.sh --tests installs it)"
new_workspace
root=$workspace/root

# Programs of this host with their libraries; perl listens in the relays' place.
copy_programs() {
  local program libraries
  mkdir -p "$root"/usr/{bin,sbin,lib,lib64} "$root"/{dev,proc,sys,run,tmp,etc/skein/invitation,var/lib/dpkg/{info,updates}}
  for program in bin sbin lib lib64; do ln -s "usr/$program" "$root/$program"; done
  touch "$root/var/lib/dpkg/status"
  for program in bash sh env setpriv cat cut dirname flock getent grep head hostname ip jq mawk mkdir nice nproc perl realpath rm sed sleep stat \
    tail test timeout touch tr; do
    program=$(PATH=/usr/bin:/usr/sbin type -P "$program") || fail "no $program"
    libraries=$(ldd "$program" | grep -o '/[^ ]*')
    (cd / && cp -L --parents $program $libraries "$root")
  done
  ln -s mawk "$root/usr/bin/awk"
  (cd / && cp -a --parents usr/lib/*/perl-base usr/lib/locale/C.utf8 "$root")
}

write_stand_ins() {
  local bin=$1 service
  mkdir -p "$bin"
  cat >"$bin/skein-ingest" <<'SERVICE'
#!/bin/bash
words=" $* " instance=${words##* --instance } port=${words##* --port }
if [[ $0 == *relay ]]; then
  exec perl -MSocket -e 'socket(S, PF_INET, SOCK_STREAM, 0); setsockopt(S, SOL_SOCKET, SO_REUSEADDR, 1);
    bind(S, sockaddr_in($ARGV[0], INADDR_ANY)) or die; listen(S, 9); close(C) while accept(C, S);' "${port%% *}"
fi
trap 'exit 0' TERM
echo "ready ${instance%% *}"
while :; do touch "$SKEIN_ALIVE_FILE"; sleep 0.1; done
SERVICE
  for service in features retrieval matching mapper merger guide dense web relay; do ln -s skein-ingest "$bin/skein-$service"; done
  cat >"$bin/skein" <<'SKEIN'
#!/bin/bash
site=/var/lib/skein/site
case $1 in
  --version) echo 'a stand-in' ;;
  launched) # DIR --lcm-url URL, or DIR --browser-address ADDRESS
    note=lcm_url
    [[ $3 == --lcm-url ]] || note=web_public
    echo "$4" >"$2/run/$note"
    ;;
  launch) shift; SKEIN_BUILD=/usr/lib/skein SKEIN_SUBCOMMANDS=1 exec /usr/lib/skein/scripts/launch.sh "$@" ;;
  demand) exec /usr/lib/skein/bin/skein-ingest "$@" ;;
  demo) mkdir -p "$HOME/demo" && echo picture >"$HOME/demo/model.png" ;;
  invite) sed 's|^\(.*\)://\(.*\)|skein://\2/\1/0123456789abcdef/worker/workers/code|' "$site/run/lcm_url" ;;
  finish) echo '{"images": {"received": 12, "registered": 12, "deferred": 0, "failed": 0}}' >"$site/report.json" ;;
esac
SKEIN
  chmod +x "$bin"/skein{,-ingest}
}

install_package() {
  local package=$workspace/package
  mkdir -p "$package"/{DEBIAN,usr/bin,usr/lib/skein/scripts,usr/share/doc/skein,var/lib/skein}
  write_stand_ins "$package/usr/lib/skein/bin"
  ln -s ../lib/skein/bin/skein "$package/usr/bin/skein"
  cp "$SKEIN_ROOT"/scripts/{launch,lib,mapper_pool}.sh "$package/usr/lib/skein/scripts/"
  gzip -c "$SKEIN_ROOT/CHANGELOG.md" >"$package/usr/share/doc/skein/changelog.gz"
  printf '%s\n' 'Package: skein' 'Version: 0.1.0-1+test' "Architecture: $(dpkg --print-architecture)" \
    'Maintainer: a test <test@localhost>' 'Description: a stand-in' >"$package/DEBIAN/control"
  dpkg-deb -Znone --root-owner-group --build "$package" "$package.deb" >/dev/null
  dpkg --root="$root" --force-depends --log=/dev/null --install "$package.deb" >"$workspace/dpkg.log" || fail "dpkg"
}

in_image=("$SKEIN_ROOT/scripts/image_run.sh" run "$workspace/image") # then its options, and words

copy_programs
install_package
# A PATH without engines: packaging/oci_image.py writes the image.
mkdir "$workspace/tools"
ln -s /usr/bin/* /usr/sbin/* "$workspace/tools/" 2>/dev/null || true
rm -f "$workspace"/tools/{buildah,podman}
build_image() { PATH=$workspace/tools "$SKEIN_ROOT/scripts/image.sh" --root "$root" --output "$1" >"$workspace/build.log" 2>&1 || fail "image.sh: $(<"$workspace/build.log")"; }
build_image "$workspace/first"
build_image "$workspace/second"
image=$workspace/first/skein_0.1.0-1+test_$(dpkg --print-architecture).image.tar
cmp "$image" "$workspace/second/$(basename "$image")" || fail "two images of one root differ"
[[ $(ls "$workspace/first") == "$(basename "$image")" ]] || fail "left behind: $(ls "$workspace/first")"

"$SKEIN_ROOT/scripts/image_run.sh" unpack "$image" "$workspace/image"
[[ $(jq -r .User "$workspace/image/config") == 10001:10001 ]] || fail "the image's user: $(<"$workspace/image/config")"
mkdir "$workspace/damaged"
tar -xf "$image" -C "$workspace/damaged"
layer=$(find "$workspace/damaged/blobs" -type f -size +100k)
printf x | dd of="$layer" bs=1 seek=1000 conv=notrunc status=none
tar -cf "$workspace/damaged.tar" -C "$workspace/damaged" .
! "$SKEIN_ROOT/scripts/image_run.sh" unpack "$workspace/damaged.tar" "$workspace/unpacked" 2>"$workspace/said" || fail "a damaged layer was unpacked"
grep -q 'has other bytes' "$workspace/said" || fail "unclear: $(<"$workspace/said")"

# A process 1 that is nobody and may nothing. The root cannot be written.
said=$("${in_image[@]}" --entrypoint bash -c 'echo "$$ $UID $HOME $PWD"; grep -E "^(CapBnd|NoNewPrivs)" /proc/self/status; touch /x 2>/dev/null || touch /tmp/x && echo confined')
[[ $said == $'1 10001 /var/lib/skein /var/lib/skein\nCapBnd:\t0000000000000000\nNoNewPrivs:\t1\nconfined' ]] || fail "in the image: $said"
status=0
"${in_image[@]}" --entrypoint sh -c 'exit 7' || status=$?
((status == 7)) || fail "exit code $status, not 7"

PATH=$workspace/tools "$SKEIN_ROOT/scripts/test_image.sh" --image "$image" --engine chroot >"$workspace/test_image.log" 2>&1 || fail "test_image.sh"
grep -q '^== passed by chroot' "$workspace/test_image.log" || fail "test_image.sh did not pass"

# As a pod: by a name that /etc/hosts has. Two workers of one invitation have names of their own.
ip addr add 10.77.0.3/32 dev lo
echo '10.77.0.3 skein-0.skein.field.svc.cluster.local skein-0' >"$workspace/hosts"
mount --bind "$workspace/hosts" /etc/hosts
install -d -o 10001 -g 10001 "$workspace"/{sessions,worker-1,worker-2}
pod_words() {
  python3 - "$SKEIN_ROOT/packaging/kubernetes/session.yaml" <<'PY'
import sys, yaml
pod = next(item for item in yaml.safe_load_all(open(sys.argv[1])) if item['kind'] == 'StatefulSet')['spec']['template']['spec']
values = {'POD': 'skein-0', 'NAMESPACE': 'field', 'HOST': 'skein.example.org'}
for word in pod['containers'][0]['args']:
    for name, value in values.items(): word = word.replace(f'$({name})', value)
    print(word)
PY
}
mapfile -t words < <(pod_words)
"${in_image[@]}" --volume "$workspace/sessions:/var/lib/skein" "${words[@]}" >"$workspace/pod.log" 2>&1 &
pod=$!
is_ready() { grep -q 'processes are ready' "$workspace/$1.log" 2>/dev/null; }
wait_until 30 "the pod's session is ready" is_ready pod
[[ -e $workspace/sessions/site/log/relay-7701.log ]] || fail "the pod has no relays: $(ls "$workspace/sessions/site/log")"
[[ $(<"$workspace/sessions/site/run/web_public") == https://skein.example.org:8471 ]] || fail "$(<"$workspace/sessions/site/run/web_public")"
echo skein://skein-0.skein.field.svc.cluster.local:7700/tcpqs/0123456789abcdef/worker/workers/code >"$workspace/link"
workers=()
for worker in worker-1 worker-2; do
  "${in_image[@]}" --volume "$workspace/link:/etc/skein/invitation/link" --volume "$workspace/$worker:/tmp/worker" \
    launch --join @/etc/skein/invitation/link --session /tmp/worker --mappers 0 --features 1 --matching 1 >"$workspace/$worker.log" 2>&1 &
  workers+=($!)
done
for worker in worker-1 worker-2; do wait_until 30 "$worker joins" is_ready "$worker"; done
twice=$(cd "$workspace" && ls worker-1/log worker-2/log | sort | uniq -d | grep features || true)
[[ -z $twice ]] || fail "two workers have one name: $twice"
for process in "${workers[@]}" "$pod"; do
  kill -TERM "$process"
  wait "$process" || fail "a container ended by SIGTERM: exit code $?"
done
