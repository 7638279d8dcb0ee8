#!/usr/bin/env bash
# Does it work where nothing is installed? A bare Debian by debootstrap, this checkout copied into it, ./run inside.
#   test/fresh/try.sh bookworm|trixie [build|sim|test [ARGUMENT ...]]     default: build
# Needs root's rights, debootstrap, 8 GB below /var/tmp and half an hour. Not a part of ./run test.
# KEEP=FOLDER: the root is made there and stays; a second try goes on from it. MIRROR=URL: of Debian, instead of this machine's.
set -euo pipefail
# shellcheck source=test/fresh/root.sh
source "$(dirname "${BASH_SOURCE[0]}")/root.sh"

case ${1:-} in
  bookworm | trixie) release=$1 ;;
  *) sed -n '2,5s/^# \?//p' "$0" >&2; exit 2 ;;
esac
shift
[[ $# -gt 0 ]] || set -- build

if [[ -n ${KEEP:-} ]]; then
  folder=$KEEP
else
  folder=$(mktemp -d /var/tmp/fresh.XXXXXX)
  trap 'rm -rf --one-file-system "$folder"' EXIT
fi

make_root "$release" "$folder"
copy_checkout "$folder"
echo "try: ./run $*"
inside "$folder" /train_derail/run "$@"
[[ $1 != build ]] || inside "$folder" bash -c 'source /train_derail/build/devel/setup.bash && rosrun train_derail derail run /train_derail/config/baseline.yaml'
echo "try: ./run $* works on a fresh $release"
