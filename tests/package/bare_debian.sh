#!/bin/bash
# bare_debian.sh BUILD: packs BUILD's program, installs the package with apt on a bare Debian 12 in a folder of its own, scans there as
# an ordinary user with no option, and purges it. The mirror is the machine's. Exit status 77, with the reason, where this cannot be.
set -euo pipefail
build=$1
skip() { echo "SKIPPED: $*"; exit 77; }
fail() { echo "FAILED: $*"; exit 1; }

[ "$EUID" = 0 ] || skip "not root, which a chroot needs"
for tool in debootstrap dpkg-shlibdeps file; do
  PATH=$PATH:/sbin:/usr/sbin command -v "$tool" >/dev/null || skip "no $tool (./run test --all installs it where apt can)"
done
unshare --mount true 2>/dev/null || skip "this machine forbids mounts"
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' 'Component: main' | head -1)
[ -n "$mirror" ] || skip "apt on this machine has no source of Debian 12"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root
(cd "$work" && cpack --config "$build/CPackConfig.cmake" -G DEB -B "$work" >"$work/cpack.log" 2>&1) || { cat "$work/cpack.log"; fail "cpack"; }
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$work/debootstrap.log" 2>&1 ||
  { tail -5 "$work/debootstrap.log"; skip "debootstrap cannot fetch Debian from $mirror"; }
cp "$work"/tankrig_*.deb "$root/tmp/"

cat >"$root/tmp/guest.sh" <<'GUEST'
export DEBIAN_FRONTEND=noninteractive LC_ALL=C PATH=/usr/sbin:/usr/bin:/sbin:/bin
apt-get -q -y install --no-install-recommends /tmp/tankrig_*.deb >/tmp/install.log 2>&1 || { tail -20 /tmp/install.log; exit 1; }
dpkg --verify tankrig
[ "$(dpkg-query -W -f '${Conffiles}' tankrig | awk '{ print $1 }' | xargs)" = /etc/security/limits.d/tankrig.conf ]
getent group tankrig >/dev/null
grep -q 'tankrig session info' /usr/share/man/man1/tankrig.1
none() { if "$@" | grep .; then echo "found the above, expected nothing of: $*"; exit 1; fi; }
none find /etc/systemd /etc/rc?.d -name '*tankrig*'
useradd --create-home diver
su - diver -c 'tankrig scan >scan.txt && cat scan.txt'
ls -l /home/diver/sessions/*/report.html
apt-get -q -y purge tankrig >/tmp/purge.log 2>&1
none find /etc /usr /var/lib -name '*tankrig*'
echo "installed, scanned, purged"
GUEST
# In a mount namespace: what is mounted here is gone with it, before the folder is removed.
unshare --mount --propagation private -- bash -euo pipefail -c '
  mount -t proc proc "$0/proc"
  chroot "$0" /bin/bash -euo pipefail /tmp/guest.sh </dev/null' "$root" || fail "in the bare Debian"
