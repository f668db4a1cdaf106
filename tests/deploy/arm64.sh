#!/usr/bin/env bash
# `make test-arm64`: install.sh on an emulated 64-bit ARM Debian, without a network, and a tracker
# that runs there. It proves that the installation works on that architecture, not how fast.
set -euo pipefail
SOURCE=$(cd "$(dirname "$0")/../.." && pwd)
CACHE=${XDG_CACHE_HOME:-$HOME/.cache}/rhot-arm64
SUITE=${SUITE:-bookworm}
WHEELS=${WHEELS:-$SOURCE/dist/wheels/pi}

fail() {
    echo "test-arm64: $*" >&2
    exit 1
}

[[ $EUID -eq 0 ]] || fail "root is needed (it mounts and enters a Debian): sudo make test-arm64"
for program in mmdebstrap qemu-aarch64-static update-binfmts; do
    command -v "$program" >/dev/null ||
        fail "$program is missing: sudo apt install mmdebstrap qemu-user-static binfmt-support arch-test"
done
[[ -e /proc/sys/fs/binfmt_misc/status ]] || mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc
[[ -e /proc/sys/fs/binfmt_misc/qemu-aarch64 ]] || update-binfmts --enable qemu-aarch64

# The Debian itself is made once, and kept (about 250 MB, 5 minutes).
mkdir -p "$CACHE"
if [[ ! -f $CACHE/$SUITE.tar ]]; then
    echo "== making an arm64 Debian ($SUITE)"
    mmdebstrap --quiet --format=tar --arch=arm64 --variant=minbase \
        --include=python3,python3-venv,systemd,systemd-sysv "$SUITE" "$CACHE/$SUITE.tar.new"
    mv "$CACHE/$SUITE.tar.new" "$CACHE/$SUITE.tar"
fi
[[ -n $(find "$WHEELS" -name 'rhot-*.whl' 2>/dev/null) ]] || fail "no wheels in $WHEELS: make wheels"

ROOT=$(mktemp -d /var/tmp/rhot-arm64.XXXXXX)
clean_up() {
    umount -q "$ROOT/proc" "$ROOT/dev" 2>/dev/null || true
    rm -rf --one-file-system "$ROOT"
}
trap clean_up EXIT
tar -C "$ROOT" -xpf "$CACHE/$SUITE.tar" --exclude='./dev/*'
mount -t proc proc "$ROOT/proc"
mount -t tmpfs -o mode=755 tmpfs "$ROOT/dev"
for device in null zero full random urandom; do
    cp -a "/dev/$device" "$ROOT/dev/$device"
done
ln -s /proc/self/fd "$ROOT/dev/fd"
mkdir "$ROOT/dev/shm" "$ROOT/srv/wheels" "$ROOT/srv/deploy"
cp "$WHEELS"/*.whl "$ROOT/srv/wheels/"
cp -r "$SOURCE/deploy/." "$ROOT/srv/deploy/"
mkdir "$ROOT/srv/proof"
cp -r "$SOURCE/testing" "$SOURCE/tests/deploy/arm64_tracker.py" "$ROOT/srv/proof/"

inside() { env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 chroot "$ROOT" "$@"; }

# A network of its own, with loopback only: nothing can be fetched.
inside_offline() { env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
    unshare --net -- sh -c 'ip link set lo up; exec chroot "$@"' sh "$ROOT" "$@"; }

echo "== $(inside uname -m), $(inside /usr/bin/python3 --version)"
echo "== install.sh pi left, offline"
inside_offline /srv/deploy/install.sh pi left --master 192.0.2.10 --wheels /srv/wheels
echo "== again: nothing may change"
again=$(inside_offline /srv/deploy/install.sh pi left --master 192.0.2.10 --wheels /srv/wheels)
echo "$again"
[[ $again == *"Nothing to do"* ]] || fail "the second run changed something"
echo "== what is installed"
inside_offline /opt/rhot/current/bin/rhot-pi-tracker --version
inside_offline /opt/rhot/current/bin/python -c \
    'import cv2, numpy, platform, zenoh; print(platform.machine(), "cv2", cv2.__version__, "numpy", numpy.__version__)'
inside systemctl is-enabled rhot-pi.target rhot-pi-tracker@left.service
echo "== a tracker on a folder of pictures, with a router beside it"
inside_offline env PYTHONPATH=/srv/proof /opt/rhot/current/bin/python /srv/proof/arm64_tracker.py
echo "== uninstall --purge"
inside_offline /opt/rhot/current/deploy/install.sh uninstall --purge
[[ ! -e $ROOT/opt/rhot && ! -e $ROOT/etc/rhot ]] || fail "something is left"
echo "test-arm64: passed"
