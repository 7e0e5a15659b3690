#!/bin/sh
# Changes what runs of a system on this host, and takes it back. The playbook calls it; so does
# systemd, when a deployment is lost, and the unit, when it starts.
#   releases/ID  what was brought           live     what runs: the files of one of them
#   current      the ID of that             sums     the digests of its files, to notice edits
#   pending      during a deployment: the release before, and the state of the unit
#   kept         the same, from the end of it until all hosts have ended it
set -eu
umask 022
export LC_ALL=C PYTHONDONTWRITEBYTECODE=1
# @SETTINGS@
here=$(cd "$(dirname "$0")" && pwd)
root=${here%/releases/*} release=${here##*/plan-} release=${release##*/} verb=$1 owner=${2-}
folder=${root%/systems/*} guard="${unit%.service}-way-back" deadline=$(($(date +%s) + 60))
if [ "$scope" = user ]; then
  export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-/run/user/$(id -u)}"
  runtime=$XDG_RUNTIME_DIR config=${XDG_CONFIG_HOME:-$HOME/.config} log=--user-unit
else
  runtime=/run config=/etc log=--unit
fi
taken_back="$part heard nothing of the deployment for $seconds s, and went back"
units=$config/systemd/$scope hold=$runtime/composer/$unit.hold lock=$runtime/composer/$unit.lock

fail() { printf '%s\n' "$*" >&2; exit 1; }
ctl() { systemctl --"$scope" "$@"; }
show() { ctl show --value --property="$1" -- "$unit"; }
runs() { ctl is-active --quiet -- "$unit"; }
read_file() { cat "$1" 2>/dev/null || echo none; }
write_file() { cat >"$1.new"; mv "$1.new" "$1"; }
disarm() { ctl stop "$guard.timer" 2>/dev/null || true; }
is_mine() { [ "$(read_file "$lock/owner")" = "$owner" ]; }

# Without a further word of the deployment, the host goes back after so many seconds.
arm() {
  disarm
  systemd-run --"$scope" --quiet --collect --on-active="$1" --timer-property=AccuracySec=100ms \
    --unit="$guard" /bin/sh "$root/change" back "$owner"
}

# One at a time; the way back waits for the step that is under way.
alone() { exec 9>"$root/mutex"; flock 9; }

step() {
  alone
  is_mine || fail "$taken_back"
  arm "${1:-$seconds}"
}

# The release becomes what runs; files of others stay.
place() {
  mkdir -p "$root/live"
  if [ -e "$root/sums" ]; then
    sed 's/^[0-9a-f]*  //' "$root/sums" | while IFS= read -r name; do
      [ -e "$root/releases/$1/$name" ] || rm -f -- "$root/live/$name"
    done
  fi
  # A library that is loaded must not be written to; modules must be newer than what was compiled.
  cp -R --preserve=mode --remove-destination "$root/releases/$1/." "$root/live"
  (cd "$root/releases/$1" && find . -type f -exec sha256sum {} +) | write_file "$root/sums"
  echo "$1" | write_file "$root/current"
  if ! cmp -s "$root/live/unit" "$units/$unit"; then
    mkdir -p "$units"
    cp "$root/live/unit" "$units/$unit"
    ctl daemon-reload
  fi
}

list_conflicts() {
  if [ -e "$root/sums" ]; then
    (cd "$root/live" && sha256sum -c --ignore-missing "$root/sums" 2>/dev/null || true) |
      sed -n 's/^\.\/\(.*\): FAILED$/\1/p' | while IFS= read -r name; do
      cmp -s "$root/live/$name" "$here/$name" || echo "$root/live/$name was edited there"
    done
    (cd "$here" && find files -type f 2>/dev/null || true) | while IFS= read -r name; do
      [ ! -e "$root/live/$name" ] || grep -qF "  ./$name" "$root/sums" ||
        cmp -s "$root/live/$name" "$here/$name" ||
        echo "$root/live/$name is there, and was not brought by Composer"
    done
    [ "$(sed -n 's/^part=//p' "$root/live/change")" = "$(sed -n 's/^part=//p' "$here/change")" ] ||
      echo "$root is of another name of this host: remove that first, by 'composer deploy --remove'"
  fi
  [ ! -e "$units/$unit" ] || cmp -s "$units/$unit" "$root/live/unit" ||
    cmp -s "$units/$unit" "$here/unit" ||
    echo "$units/$unit is there, and Composer did not write it so"
}

# The first line says what is to be done, the others are the wheels that the host lacks.
look() {
  if [ -e "$root/pending" ]; then
    [ ! -d "$lock" ] || fail "'$part' is being deployed by $(read_file "$lock/owner")"
    sh "$root/change" back >/dev/null
  fi
  [ -e "$here/change" ] || fail "the rest of an earlier deployment was removed: deploy again"
  if [ ! -e "$here/part" ]; then
    if [ -e "$root/current" ]; then echo remove; else echo nothing; fi
    return
  fi
  conflicts=$(list_conflicts)
  [ -z "$conflicts" ] || fail "$conflicts"
  if ! runs; then
    echo start
  elif [ "$(read_file "$root/current")" = "$release" ] &&
    (cd "$root/live" && sha256sum --status -c "$root/sums"); then
    echo nothing
  elif cmp -s "$here/unit" "$root/live/unit" && cmp -s "$here/composer" "$root/live/composer" &&
    [ "$(sed '/^  plan/d' "$here/part")" = "$(sed '/^  plan/d' "$root/live/part")" ]; then
    echo compare
  else
    echo restart
  fi
  mkdir -p "$folder/wheels"
  [ -e "$folder/venvs/$venv/ready" ] || while IFS= read -r wheel; do
    [ -e "$folder/wheels/$wheel" ] || echo "$wheel"
  done <"$here/wheels.txt"
}

claim() {
  mkdir -p "$runtime/composer"
  mkdir "$lock" 2>/dev/null || fail "'$part' is being deployed by $(read_file "$lock/owner")"
  echo "$owner" >"$lock/owner"
}

lock() {
  claim
  cp "$here/change" "$root/change.new" && mv "$root/change.new" "$root/change"
  rm -f "$root/kept"
  if [ "$scope" = user ] && [ ! -e "/var/lib/systemd/linger/$(id -un)" ]; then
    loginctl enable-linger || {
      unlock
      fail "the unit would end with the login: 'sudo loginctl enable-linger $(id -un)' there"
    }
  fi
  # Packages may take their time.
  arm 1800
}

unlock() { rm -rf "$lock"; }

install() {
  [ ! -e "$folder/venvs/$venv/ready" ] || return 0
  rm -rf "$folder/venvs/$venv"
  # shellcheck disable=SC2086 # options
  "$python" -m venv --without-pip $venv_options "$folder/venvs/$venv"
  sed "s|^|$folder/wheels/|" "$here/wheels.txt" | tr '\n' '\0' | xargs -0 \
    "$folder/venvs/$venv/bin/python" "$(echo "$folder"/wheels/pip-*.whl)/pip" install --quiet \
    --no-index --no-deps --no-compile --no-cache-dir --isolated --disable-pip-version-check
  touch "$folder/venvs/$venv/ready"
}

# Composer in the release, with the variables of the unit.
in_unit() {
  set -- "$here/part" "$@"
  file=$(sed -n 's/^EnvironmentFile=//p' "$here/unit" | sed "s|%E|$config|")
  systemd-run --"$scope" --quiet --collect --wait --pipe ${file:+--property=EnvironmentFile="$file"} \
    --setenv=PYTHONDONTWRITEBYTECODE=1 "$@" </dev/null
}

# Installs and checks the release; the first line says how it comes to run.
prepare() {
  [ "$3" != remove ] || { echo remove; return; }
  install
  if grep -q '^  build)' "$here/part"; then "$here/part" build >&2; fi
  [ "$3" = compare ] || in_unit check >&2
  plan "$@"
}

plan() {
  if [ "$3" != compare ]; then
    echo "$3"
  else
    changes=$(in_unit plan)
    printf '%s\n' "$changes" | grep -q '^ *± system' && echo restart || echo reload
    printf '%s\n' "$changes"
  fi
  mkdir -p "$root/live/files"
  (cd "$root/live/files" && diff -ruN -x __pycache__ . "$here/files" | grep -v '^diff ') || true
}

take() {
  step
  { read_file "$root/current"; runs && echo active || echo inactive
    ctl is-enabled -- "$unit" 2>/dev/null || true; } | write_file "$root/pending"
  sync "$root"
  echo "$3" >"$lock/action"
  [ "$3" != reload ] || return 0
  ctl stop -- "$unit" 2>/dev/null || true
  [ "$3" != remove ] || return 0
  ctl reset-failed -- "$unit" 2>/dev/null || true
  date +%s >"$lock/begun"
  : >"$hold"
  place "$release"
  ctl start --no-block -- "$unit"
}

# Ends the step if the start has failed.
watch() {
  is_mine || fail "$taken_back"
  state=$(show ActiveState) queued=$(show Job)
  case $state/$(show SubState)/$(show NRestarts)/$(show Result) in
    active/*/0/* | reloading/*/0/* | activating/start*/0/* | activating/reload*/0/*) ;;
    inactive/*/0/success) [ -n "$queued" ] || [ -n "$(show ExecMainExitTimestamp)" ] || lament ;;
    inactive/*) [ -n "$queued" ] || lament ;;
    *) lament ;;
  esac
  [ "$(date +%s)" -le "$deadline" ] || lament
}

lament() {
  journalctl "$log=$unit" -o cat -q --no-pager -n 40 --since="@$(read_file "$lock/begun")" >&2
  fail "$part did not start"
}

starts() {
  case $(read_file "$lock/action") in start | restart) ;; *) return 1 ;; esac
}

held() {
  step
  exec 9>&-
  starts || return 0
  while [ -e "$hold" ] && [ ! -s "$hold" ]; do watch; sleep 0.1; done
  watch
}

go() {
  step
  [ -e "$root/pending" ] || fail "$taken_back"
  case $(read_file "$lock/action") in
    reload)
      place "$release"
      "$root/live/composer" reload "$part" --timeout 60
      ;;
    start | restart) rm -f "$hold" ;;
  esac
}

up() {
  step
  exec 9>&-
  starts || return 0
  while watch && [ "$state" = activating ]; do sleep 0.1; done
  # Long enough for systems of one name, say, to notice each other.
  sleep 1
  watch
}

keep() {
  step
  action=$(read_file "$lock/action")
  [ "$action" = remove ] || [ "$(read_file "$root/current")" = "$release" ] ||
    fail "$part went back by itself"
  [ "$action" = remove ] || ctl enable --quiet -- "$unit"
  mv "$root/pending" "$root/kept"
}

# After all hosts have kept it.
finish() {
  if [ "$here" != "$root/releases/$release" ]; then
    rm -rf "$here"
    tidy
  fi
  is_mine || return 0
  disarm
  if [ "$(read_file "$lock/action")" = remove ]; then
    wipe
  else
    before=$(head -n 1 "$root/kept")
    rm -f "$root/kept"
    for each in "$root"/releases/*; do
      case ${each##*/} in "$release" | "$before") ;; *) rm -rf "$each" ;; esac
    done
    prune
  fi
  unlock
}

# Removes what no release needs.
prune() {
  for each in "$folder"/venvs/* "$folder"/wheels/*; do
    grep -qsF "${each##*/}" "$folder"/systems/*/releases/*/composer \
      "$folder"/systems/*/releases/*/wheels.txt || rm -rf "$each"
  done
}

back() {
  alone
  [ ! -d "$lock" ] || is_mine || return 0
  disarm
  note=$root/pending
  # Only a deployment that has failed elsewhere takes back what was kept.
  if [ "${3-}" = all ] && [ -e "$root/kept" ]; then note=$root/kept; fi
  if [ ! -e "$note" ]; then
    [ -e "$root/current" ] || wipe
    unlock
    return
  fi
  { read -r before; read -r state; read -r enabled || enabled=; } <"$note"
  if [ "$before" = none ]; then
    wipe
    echo "all of it was removed again"
  else
    if [ "$(read_file "$lock/action")" = reload ] && runs; then
      place "$before"
      rm -f "$note"
      "$root/live/composer" reload "$part" --timeout 60 >/dev/null || ctl restart --no-block -- "$unit"
    else
      ctl stop -- "$unit" 2>/dev/null || true
      rm -f "$hold"
      place "$before"
      rm -f "$note"
      [ "$enabled" != enabled ] || ctl enable --quiet -- "$unit"
      [ "$state" != active ] || ctl start --no-block -- "$unit"
    fi
    echo "the release before was restored"
  fi
  unlock
}

# Files that others have edited are kept.
wipe() {
  ctl stop -- "$unit" 2>/dev/null || true
  ctl disable --quiet -- "$unit" 2>/dev/null || true
  if cmp -s "$root/live/unit" "$units/$unit"; then rm -f "$units/$unit"; fi
  ctl daemon-reload
  ctl reset-failed -- "$unit" 2>/dev/null || true
  rm -f "$hold"
  if [ -e "$root/sums" ]; then
    (cd "$root/live" && sha256sum -c "$root/sums" 2>/dev/null || true) | sed -n 's/: OK$//p' |
      while IFS= read -r name; do rm -f -- "$root/live/$name"; done
    find "$root/live" -name __pycache__ -prune -exec rm -rf {} +
    find "$root/live" -type d -empty -delete
    if [ -e "$root/live" ]; then
      mkdir -p "$folder/edited"
      cp -R "$root/live" "$folder/edited/${root##*/}"
      echo "files that were edited are kept in $folder/edited/${root##*/}"
    fi
  fi
  for name in releases live current sums pending kept change mutex; do rm -rf "${root:?}/$name"; done
  prune
  tidy
}

tidy() {
  for each in "$root/releases" "$root" "$folder/systems" "$folder/venvs" "$folder/wheels" "$folder"; do
    rmdir "$each" 2>/dev/null || true
  done
}

remove() {
  claim
  wipe
  unlock
}

# Without a file that holds it, as after a boot, a deployment that was cut off is taken back.
start() {
  if [ -e "$root/pending" ] && [ ! -e "$hold" ]; then
    before=$(head -n 1 "$root/pending")
    [ "$before" != none ] || exit 2
    place "$before"
    rm -f "$root/pending"
  fi
  unset PYTHONDONTWRITEBYTECODE
  exec "$root/live/part" up --hold "$hold"
}

"$verb" "$@"
