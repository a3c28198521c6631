# The sets of photos and the kinds of captures: source it after scripts/lib.sh. Wants `datasets`, and `places`,
# a folder for sets that are rendered.

# The cheapest first. Besides: video, blank and crowd, hard places of `skein sim`; PATH of a folder with images/
# and, if there is a truth, truth (what `skein evaluate` takes).
readonly all_sets="fountain-P11 rgbd-scene odm-copr temple-ring caliterra oppaiyama south-building statue-of-liberty mamechun-room"
readonly all_kinds="name shuffle-1 shuffle-2 agents turns second third half quality-50 two-sets foreign rotation rotation-no-exif exposure low-contrast zoom zoom-no-exif overlay orientations bursts"

is_rendered() { [[ $1 == video || $1 == blank || $1 == crowd ]]; }
is_set() { [[ $1 == */* || " $all_sets " == *" $1 "* ]] || is_rendered "$1"; }
is_kind() { [[ $1 =~ ^shuffle-[0-9]+$ || " $all_kinds " == *" $1 "* ]]; }

# Of these no map is expected.
is_rotation() { [[ $1 == rotation* ]]; }

# folder_of SET: where it lies
folder_of() {
  if [[ $1 == */* ]]; then echo "$1"; elif is_rendered "$1"; then echo "$places/$1"; else echo "$datasets/$1"; fi
}

# render SET: unless it is there
render() {
  case $1 in
    video) render_place "$places/$1" 1 250 --scenario video --size 640x480 --seed 11 ;;
    blank) render_place "$places/$1" 1 120 --scenario blank --seed 11 ;;
    crowd) render_place "$places/$1" 1 150 --scenario crowd --seed 11 ;;
  esac
}

# photos_of SET: sets `photos`, sorted by name; none where the set is absent
photos_of() {
  local folder=images pattern='*' repeated
  [[ $1 != rgbd-scene ]] || folder=frames pattern='*.color.jpg'
  mapfile -t photos < <(find "$(folder_of "$1")/$folder" -type f -name "$pattern" 2>/dev/null | sort)
  repeated=$(printf '%s\n' "${photos[@]##*/}" | sort | uniq -d | head -1)
  [[ -z $repeated ]] || die "$(folder_of "$1")/$folder has two photos named $repeated: a set is one agent's"
}

# truth_of SET FOLDER: what `skein evaluate` takes, made in FOLDER where the set has it in another form; nothing
# where there is none
truth_of() {
  local folder
  folder=$(folder_of "$1")
  case $1 in
    fountain-P11) echo "$folder/gt_dense_cameras" ;;
    temple-ring) echo "$folder/templeR_par.txt" ;;
    south-building) echo "$folder/reference" ;; # of COLMAP 4.2.1
    rgbd-scene) tum_lines "$folder/frames" >"$2/rgbd-scene.txt" && echo "$2/rgbd-scene.txt" ;;
    *) [[ ! -e $folder/truth ]] || echo "$folder/truth" ;;
  esac
}

# tum_lines FRAMES: of NAME.pose.txt, 4 x 4 matrices of the camera in the world
tum_lines() {
  local pose
  for pose in "$1"/*.pose.txt; do
    awk -v name="$(basename "${pose%.pose.txt}").color.jpg" '
      { for (i = 1; i <= 4; ++i) m[NR, i] = $i }
      function sign_of(x) { return x < 0 ? -1 : 1 }
      function root(x) { return x > 0 ? sqrt(x) : 0 }
      END {
        w = root(1 + m[1, 1] + m[2, 2] + m[3, 3]) / 2
        x = root(1 + m[1, 1] - m[2, 2] - m[3, 3]) / 2 * sign_of(m[3, 2] - m[2, 3])
        y = root(1 - m[1, 1] + m[2, 2] - m[3, 3]) / 2 * sign_of(m[1, 3] - m[3, 1])
        z = root(1 - m[1, 1] - m[2, 2] + m[3, 3]) / 2 * sign_of(m[2, 1] - m[1, 2])
        print name, m[1, 4], m[2, 4], m[3, 4], x, y, z, w
      }' "$pose"
  done
}
