# The mappers of launch.sh, which sources this: MIN of them always, more while submaps wait. How many
# are missing is heard by `skein demand`, whose lines are read from its log; a mapper above MIN ends
# itself when it has been idle for retire_after_s. Every host may have such a pool: a submap is leased
# to one mapper by ingest, so that a mapper too many does nothing but leave.

readonly retire_after_s=10
demand=${prefix}demand pool_is_full=0

# start_pool: sets up what runs always
start_pool() {
  local number
  for ((number = 1; number <= min_mappers; number++)); do add_mapper "$number"; done
  ((min_mappers == max_mappers)) ||
    add_instance "$demand" "$bin/skein" demand "${where[@]}" --lcm-url "$url" --instance "$demand"
}

add_mapper() {
  local options=("${mapper_options[@]}")
  (($1 <= min_mappers)) || options+=(--retire-after "$retire_after_s")
  add_service "${prefix}mapper-$1" mapper "${options[@]}"
}

is_elastic() { [[ ${command_of[$1]} == *--retire-after* ]]; }
is_instance() { [[ -n ${command_of[$1]:-} ]]; }

# The latest word of the demand process that runs now: "short N of MAPPER MAPPER ...".
latest_demand() {
  tail -c "+$((${log_offset[$demand]} + 1))" "$session/log/$demand.log" | grep '^short [0-9]* of' | tail -n 1
}

# One mapper more for each submap that waits and finds none idle. Not while one of ours has not been
# heard yet: it may be the one that is missing.
grow_pool() {
  ((min_mappers < max_mappers)) && [[ -n ${pid_of[$demand]:-} ]] || return 0
  local heard missing number mapper
  heard=$(latest_demand) || return 0
  missing=${heard#short } missing=${missing%% *}
  ((missing > 0)) || { pool_is_full=0; return 0; }
  for mapper in "${instances[@]}"; do
    [[ $mapper != "$prefix"mapper-* || " $heard " == *" $mapper "* ]] || return 0
  done
  for ((number = 1; number <= max_mappers && missing > 0; number++)); do
    ! is_instance "${prefix}mapper-$number" || continue
    say "a map waits for a mapper: ${prefix}mapper-$number starts"
    add_mapper "$number"
    missing=$((missing - 1))
  done
  ((missing == 0 || pool_is_full)) || { pool_is_full=1; warn "a map waits, and all $max_mappers mappers are busy (--mappers MIN:MAX): one takes it beside its own"; }
}
