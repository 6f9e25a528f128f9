#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Types README's commands in a bare Debian: a debootstrap minimal root with a clone of HEAD in it. Says how long each
# took and what it ended with, then repeats the build and the tests from scratch with the network cut off.
#
#   scripts/fresh_machine.sh [bookworm | trixie]
#
# Environment: ROOTS (where roots are put, default /var/tmp/psweep-roots; the bare one is kept as a tar file there),
# MIRROR (of Debian, default debootstrap's), OFFLINE=no (leave out the second part), KEEP=yes (leave the root behind).
# Needs root, debootstrap and 4 GB. apt's settings (proxy and the like) and name servers are taken from this machine.
# The commands are the first code block of README.md's section "Quick start", line by line.
# Exit code 1 if a command failed.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/{/^# SPDX/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
esac
suite=${1:-bookworm}
say() { printf 'fresh-machine: %s: %s\n' "$suite" "$*"; }
die() { say "$*" >&2; exit 1; }

case $suite in bookworm | trixie) ;; *) die "no Debian that psweep knows; bookworm or trixie" ;; esac
[ "$(id -u)" -eq 0 ] || die "needs root, for chroot and mount"
command -v debootstrap > /dev/null || die "debootstrap is missing; apt-get install debootstrap"

roots=${ROOTS:-/var/tmp/psweep-roots}
mkdir -p "$roots"
bare=$roots/$suite.tar
root=$roots/$suite-$$
clean_up() {
  local mounted
  for mounted in dev proc; do
    if mountpoint -q "$root/$mounted"; then umount "$root/$mounted"; fi
  done
  # Never through a mount that would not go.
  if [ "${KEEP:-no}" != yes ] && ! grep -q " $root/" /proc/mounts; then rm -rf "$root"; fi
}
trap clean_up EXIT
trap 'exit 130' INT TERM

if [ ! -e "$bare" ]; then
  say "debootstrap"
  rm -rf "$root"
  debootstrap --variant=minbase "$suite" "$root" ${MIRROR:+"$MIRROR"} > "$bare.log" 2>&1 ||
    die "debootstrap failed: $(tail -n 3 "$bare.log")"
  tar -C "$root" -cf "$bare.part" .
  mv "$bare.part" "$bare"
else
  mkdir -p "$root"
  tar -C "$root" -xpf "$bare"
fi

cp -L /etc/resolv.conf "$root/etc/resolv.conf"
apt-config dump Acquire | grep -vE '"";$' > "$root/etc/apt/apt.conf.d/99host" || true
mount -t proc proc "$root/proc"
mount --bind /dev "$root/dev"
git clone -q --no-hardlinks . "$root/psweep"
say "bare root with $(git rev-parse --short HEAD), Debian $(cat "$root/etc/debian_version"); no make, no compiler:" \
  "$(chroot "$root" sh -c 'command -v make git g++ sudo || echo none')"

# in_root [unshare -n] -- COMMAND: as a user would type it at the prompt, in the clone.
in_root() {
  local wrap=()
  while [ "$1" != -- ]; do wrap+=("$1"); shift; done
  "${wrap[@]}" env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp TERM=dumb \
    chroot "$root" bash -c 'cd /psweep && eval "$1"' bash "$2" < /dev/null
}

failed=0
results=()
run() { # run LOGNAME WHAT [unshare -n] -- COMMAND
  local log=$roots/$suite-$1.log what=$2 code=0
  shift 2
  say "$what"
  SECONDS=0
  in_root "$@" > "$log" 2>&1 || code=$?
  if [ $code -ne 0 ]; then
    tail -n 30 "$log"
    failed=1
  fi
  grep '^setup:' "$log" || true
  tail -n 1 "$log"
  results+=("$(printf '%5d s  exit %d  %s' "$SECONDS" "$code" "$what")")
}

mapfile -t commands < <(awk '/^## / { here = /^## Quick start/ } here && /^```/ { if (inside) exit; inside = 1; next }
  here && inside && !/^[ ]*(#|$)/' README.md)
[ ${#commands[@]} -gt 0 ] || die "README.md has no code block in a section 'Quick start'"
number=0
for command in "${commands[@]}"; do
  number=$((number + 1))
  run "$number" "$command" -- "$command"
  [ $failed -eq 0 ] || break
done

if [ $failed -eq 0 ] && [ "${OFFLINE:-yes}" != no ]; then
  if in_root unshare -n -- 'apt-get update 2>&1 | grep -q "^Err\|^W: Failed"'; then
    run offline "make clean sim, without network" unshare -n -- 'make clean && make sim'
  else
    say "the network could not be cut off"
    failed=1
  fi
fi

say "summary"
printf '%s\n' "${results[@]}"
exit $failed
