#!/usr/bin/env bash
# Every program says its version and the commit that it was built from. The source file that says so is written anew for
# another commit alone, in a shallow clone, too. Where the tree is no repository the version stands by itself.
source "$(dirname "$0")/../harness.sh"
new_workspace

# said_in FILE: what a source file of WriteCommit.cmake says
said_in() { sed -n 's/.*return "\(.*\)".*/\1/p' "$1"; }

version=$(sed -n 's/^project(skein VERSION \([0-9.]*\) .*/\1/p' "$SKEIN_ROOT/CMakeLists.txt")
built=$(said_in "$SKEIN_BUILD/generated/commit.cc") # HEAD may have moved since
[[ $built == "$version" || $built == "$version ("?*")" ]] || fail "version $version was built as '$built'"
for program in skein skein-{ingest,features,retrieval,matching,mapper,merger,guide,dense,relay,web}; do
  said=$("$SKEIN_BUILD/bin/$program" --version) || fail "$program --version: exit code $?"
  [[ $said == "$program $built" ]] || fail "$program says '$said', not '$program $built'"
done

command -v git >/dev/null || skip "no git: how a commit is found was not tried"
unset GIT_DIR GIT_INDEX_FILE GIT_WORK_TREE
repository=$workspace/repository
output=$workspace/commit.cc

commit() { git -C "$repository" -c user.name=a -c user.email=a@example.invalid -c commit.gpgsign=false commit -q --allow-empty -m "$1"; }

# expect TEXT FOLDER
expect() {
  cmake -DSOURCE="$2" -DVERSION=1.2.3 -DOUTPUT="$output" -P "$SKEIN_ROOT/cmake/WriteCommit.cmake" || fail "WriteCommit.cmake in $2"
  [[ $(said_in "$output") == "$1" ]] || fail "of $2: '$(said_in "$output")', not '$1'"
}

git init -q "$repository"
expect 1.2.3 "$repository" # there is no commit yet
commit one
commit two
head=$(git -C "$repository" rev-parse --short=10 HEAD)
expect "1.2.3 ($head)" "$repository"
touch -d 2001-01-01 "$output"
expect "1.2.3 ($head)" "$repository"
[[ $(stat -c %Y "$output") == "$(date -d 2001-01-01 +%s)" ]] || fail "the file was written again for the same commit"

git clone -q --depth 1 "file://$repository" "$workspace/shallow"
expect "1.2.3 ($head)" "$workspace/shallow"
git -C "$repository" worktree add -q "$workspace/worktree" HEAD 2>/dev/null
expect "1.2.3 ($head)" "$workspace/worktree"

mkdir "$repository/unpacked" "$workspace/unpacked"
expect 1.2.3 "$workspace/unpacked"
expect 1.2.3 "$repository/unpacked" # the commit around it is not its own
git -C "$repository" tag v1.2.3
commit three
expect "1.2.3 (v1.2.3-1-g$(git -C "$repository" rev-parse --short=10 HEAD))" "$repository"
