# To be sourced by what tries things on a fresh Debian: bare roots, and commands inside. Needs root's rights and debootstrap.

# make_root RELEASE FOLDER: a bare Debian, unless the folder holds one. Its mirror: $MIRROR, or where this machine's apt has its packages from.
make_root() {
  local release=$1 folder=$2
  [[ -f $folder/.whole ]] && return
  [[ $EUID -eq 0 ]] || { echo "try: only root may make a root" >&2; exit 2; }
  [[ -x /usr/sbin/debootstrap ]] || { echo "try: debootstrap is missing: apt-get install debootstrap" >&2; exit 2; }
  local mirror=${MIRROR:-$(apt-get indextargets --format '$(SITE) $(RELEASE)/$(COMPONENT)' 'Created-By: Packages' | sed -n 's,/* [a-z]*/main$,,p' | head -n 1)}
  [[ -n $mirror ]] || { echo "try: apt has no mirror configured: MIRROR=http://... $0" >&2; exit 2; }
  echo "try: a bare $release, from $mirror"
  mkdir -p "$folder"
  debootstrap --variant=minbase "$release" "$folder" "$mirror" > "$folder.log" || { tail -n 20 "$folder.log" >&2; exit 1; }
  rm -f "$folder.log"
  echo '127.0.0.1 localhost' > "$folder/etc/hosts"  # as an installer does it
  touch "$folder/.whole"
}

# inside FOLDER COMMAND ...: in a namespace of its own, so that what is mounted and what is started there ends with the command.
inside() {
  local folder=$1
  shift
  cp -L /etc/resolv.conf "$folder/etc/resolv.conf"
  unshare --mount --pid --fork --kill-child bash -c '
    mount --rbind /dev "$0/dev" && mount -t proc proc "$0/proc" &&
    exec chroot "$0" env -i HOME=/root LANG=C.UTF-8 PATH=/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$@"' "$folder" "$@"
}

# copy_checkout FOLDER: what the repository holds, with what has been changed but not committed, as a clone in /train_derail.
copy_checkout() {
  local folder=$1/train_derail root
  root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
  mkdir -p "$folder"
  git -C "$root" ls-files -z --cached --others --exclude-standard |
    (cd "$root" && xargs -0 sh -c 'for f; do [ ! -e "$f" ] || printf "%s\0" "$f"; done' sh | tar -c --null -T -) | tar -x --no-same-owner -C "$folder"
}
