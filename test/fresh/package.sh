#!/usr/bin/env bash
# Makes the Debian packages in a bare root, installs them in another one, uses them, and looks that their removal leaves nothing.
#   test/fresh/package.sh bookworm|trixie [FOLDER]      the packages are copied to FOLDER
# Needs root's rights, debootstrap, 12 GB below /var/tmp and an hour. Not a part of ./run test.
# KEEP=FOLDER: the roots are made below it and stay. MIRROR=URL: of Debian, instead of this machine's.
set -euo pipefail
# shellcheck source=test/fresh/root.sh
source "$(dirname "${BASH_SOURCE[0]}")/root.sh"

case ${1:-} in
  bookworm | trixie) release=$1 ;;
  *) sed -n '2,5s/^# \?//p' "$0" >&2; exit 2 ;;
esac

if [[ -n ${KEEP:-} ]]; then
  folder=$KEEP
  mkdir -p "$folder"
else
  folder=$(mktemp -d /var/tmp/fresh.XXXXXX)
  trap 'rm -rf --one-file-system "$folder"' EXIT
fi
maker=$folder/make user=$folder/use

echo "try: packages on $release"
make_root "$release" "$maker"
copy_checkout "$maker"
inside "$maker" bash -ec '
  export DEBIAN_FRONTEND=noninteractive
  apt-get update -q
  apt-get install -q -y --no-install-recommends build-essential lintian
  cd /train_derail
  apt-get build-dep -q -y --no-install-recommends ./
  dpkg-buildpackage -b -us -uc
  lintian --fail-on error --tag-display-limit 0 ../train-derail_*.changes'

echo "try: installed on another $release"
make_root "$release" "$user"
mkdir -p "$user/packages"
cp "$maker"/*train-derail*.deb "$user/packages"
cp -r "$(dirname "${BASH_SOURCE[0]}")/../install/consumer" "$user"
[[ -z ${2:-} ]] || cp "$maker"/*train-derail*.deb "$2"
inside "$user" bash -ec '
  export DEBIAN_FRONTEND=noninteractive ROS_HOSTNAME=localhost
  names=$(for file in /packages/*.deb; do dpkg-deb --field "$file" Package; done)
  apt-get update -q
  # What they need stays: only what the packages themselves leave is looked for.
  apt-get install -q -y --no-install-recommends man-db bash-completion g++ make cmake /packages/*.deb
  made=$(mktemp -d)
  derail run /usr/share/train_derail/config/baseline.yaml
  derail run /usr/share/train_derail/config/baseline.yaml --quiet --bag "$made/run.bag" --html "$made/run.html"
  python3 -c "import train_derail; print(train_derail.run(\"config/baseline.yaml\").outcome[\"cars_off_track\"])"
  python3 -c "from train_derail.msg import Outcome"
  timeout 300 roslaunch train_derail sim.launch rviz:=false rate:=0 exit_when_done:=true
  test -e /usr/share/doc/train-derail-doc/html/index.html
  source /usr/share/bash-completion/completions/derail
  COMP_WORDS=(derail che) COMP_CWORD=1
  _derail
  test "${COMPREPLY[*]}" = check
  man --where derail
  cmake -S /consumer -B "$made/consumer"
  cmake --build "$made/consumer"
  "$made/consumer/consumer" /usr/share/train_derail/config/baseline.yaml
  rm -rf ~/.ros "$made"
  apt-get purge -q -y $names
  left=$(find / -xdev -path /packages -prune -o \( -name "*train?derail*" -o -name "derail*" \) -not -path "/proc/*" -not -path "/var/log/*" -not -path "/var/cache/apt/*" -print)
  if [ -n "$left" ]; then echo "left behind: $left"; exit 1; fi'
echo "try: the packages work on a fresh $release, and their removal leaves nothing"
