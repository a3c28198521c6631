#!/usr/bin/env bash
# `skein config` prints a file that every service takes with --config and that changes nothing; what
# it changes is said; a wrong value, key or section ends a service at its start with one line.
source "$(dirname "$0")/../harness.sh"
new_workspace
skein=$SKEIN_BUILD/bin/skein
file=$workspace/my.toml

"$skein" config >"$file" || fail "skein config"
"$skein" config --config "$file" >"$workspace/again.toml" || fail "the defaults were refused"
diff "$file" "$workspace/again.toml" || fail "the defaults read back changed something"
for service in ingest features retrieval matching mapper merger guide dense relay web; do
  grep -qx "\[$service\]" "$file" || fail "no section of $service"
  # Every option of --help stands in the file, but for those that say where a process runs.
  "$SKEIN_BUILD/bin/skein-$service" --help | grep -oE -- '^ +--[a-z-]+' | tr -d ' ' | sort -u >"$workspace/help"
  while read -r option; do
    [[ ! " --session --session-id --invite --lcm-url --auth --instance --threads --verbose --config --print-config --retire-after --help --version --port --loopback --watch-port " == *" $option "* ]] || continue
    key=${option#--}
    "$SKEIN_BUILD/bin/skein-$service" --print-config | grep -E "^(# )?${key//-/_} =" >/dev/null || fail "skein-$service: $option is not in its section"
  done <"$workspace/help"
done

# The file's values are taken, those of other services left alone, and the command line goes first.
sed -i 's/^max_features = .*/max_features = 4096/; s/^merge = .*/merge = false/; s/^cut_grace = .*/cut_grace = 3/' "$file"
"$skein" config --config "$file" | diff "$file" - || fail "values of the file were not taken"
"$SKEIN_BUILD/bin/skein-features" --config "$file" --max-features 7 --print-config | grep -x 'max_features = 7' >/dev/null || fail "the command line does not go first"

# NaN and infinity are no values, of any option of any service.
num_numbers=0
for service in ingest features retrieval matching mapper merger guide dense relay web; do
  while read -r option; do
    for value in nan inf; do
      status=0
      printf '[%s]\n%s = %s\n' "$service" "$(tr - _ <<<"${option#--}")" "$value" >"$workspace/none.toml"
      "$SKEIN_BUILD/bin/skein-$service" --config "$workspace/none.toml" --print-config >/dev/null 2>"$workspace/said" || status=$?
      ((status == 2)) && (($(wc -l <"$workspace/said") == 1)) || fail "skein-$service takes $value for $option: $(<"$workspace/said")"
      num_numbers=$((num_numbers + 1))
    done
  done < <("$SKEIN_BUILD/bin/skein-$service" --help | grep -oE -- '--[a-z-]+ FLOAT' | cut -d ' ' -f 1)
done
((num_numbers >= 10)) || fail "only $num_numbers numbers were tried"

# refuses WORDS CONTENT: skein-mapper, in one line
refuses() {
  local status=0
  printf '%b' "$2" >"$workspace/wrong.toml"
  "$SKEIN_BUILD/bin/skein-mapper" --session-id x --config "$workspace/wrong.toml" 2>"$workspace/said" || status=$?
  ((status == 2)) || fail "$2: exit code $status"
  grep -qF -- "$1" "$workspace/said" && (($(wc -l <"$workspace/said") == 1)) || fail "$2: $(<"$workspace/said")"
}
refuses 'wrong.toml: [mapper] camera_modle: there is no such key' '[mapper]\ncamera_modle = "OPENCV"\n'
refuses 'camera_model is "OPENVC": give auto, or one of' '[mapper]\ncamera_model = "OPENVC"\n'
refuses '[mapper] local_ba_images is 2: give 3 to 1000' '[mapper]\nlocal_ba_images = 2\n'
refuses 'there is no section [maper]' '[maper]\n'
