#!/usr/bin/env bash
# Installs rhot as systemd services on a Raspberry Pi with a camera, or on the master.
# docs/guide/install.md explains it; `install.sh --help` lists what it can do.
set -euo pipefail
umask 022
export LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive
unset PYTHONPATH PYTHONHOME VIRTUAL_ENV

HERE=$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")
readonly HERE
# Raspberry Pi OS and Debian build picamera2 for this Python, so no other will do.
readonly PYTHON=/usr/bin/python3
readonly ROOT=/opt/rhot ETC=/etc/rhot STATE=/var/lib/rhot CACHE=/var/cache/rhot
readonly RIGS=$ETC/rigs
readonly UNITS=/etc/systemd/system USER_UNITS=/etc/systemd/user COMMAND=/usr/local/bin/rhot
readonly SYSUSERS=/etc/sysusers.d/rhot.conf SYSCTL=/etc/sysctl.d/60-rhot.conf
readonly KEEP_VERSIONS=3

usage() {
    cat <<'TEXT'
install.sh pi CAMERA... --master HOST [options]   a Raspberry Pi with cameras
install.sh master [options]                       router, fusion and solver, viewer, recorder
install.sh rig NAME --config FILE [--pki DIR]     one more rig that this master serves
install.sh rig NAME --remove                      it serves that rig no more
install.sh upgrade [--wheels DIR]                 a new version, the same roles
install.sh rollback                               the version before
install.sh status                                 what is installed and what runs
install.sh uninstall [--purge]                    remove rhot (--purge: its data, too)

--config FILE   rig.toml of the rig; calibration/ beside it is brought where there is none yet
--pki DIR       certificates of this machine: ca.pem, own.pem, own.key (from `rhot pki`)
--wheels DIR    install from these wheels alone, without a network (`make wheels` collects them)
--wheel FILE    rhot's own wheel (or a folder that holds it); what it needs comes from PyPI
--replace       the master serves another rig than until now: its file takes the place of the old one
--simulator     run the simulator of rig.toml on this machine (a rig without cameras)
--no-start      do not start anything now; it starts with the machine
--dry-run       say what would be done, do nothing
TEXT
}

fail() {
    printf 'install.sh: error: %s\n' "$*" >&2
    exit 2
}

# ---- what is to be done, and doing it ------------------------------------------------------------

# RESTART: something has changed that the services have read.
DRY_RUN='' CHANGES=0 RESTART=''

say() { printf '%s\n' "$*"; }

# change TEXT COMMAND...: one thing that is not yet as it should be; said, then done.
change() {
    say "  - $1"
    CHANGES=$((CHANGES + 1))
    if [[ -z $DRY_RUN ]]; then "${@:2}"; fi
}

# put SOURCE TARGET MODE OWNER: a file as it should be; nothing if it is already.
put() {
    local found=''
    if [[ -e $2 ]]; then found=$(stat -c '%a %U' -- "$2"); fi
    if [[ $found == "$3 $4" ]] && cmp -s -- "$1" "$2"; then return; fi
    case $2 in "$UNITS"/* | "$ETC"/*) RESTART=yes ;; esac
    change "write $2" install -D -m "$3" -o "$4" -g "$(group_of "$4")" -T -- "$1" "$2"
}

group_of() { if [[ $1 == rhot ]]; then echo rhot; else echo root; fi; }

# folder TARGET MODE OWNER
folder() {
    if [[ -d $1 && $(stat -c '%a %U' -- "$1") == "$2 $3" ]]; then return; fi
    change "make the folder $1" install -d -m "$2" -o "$3" -g "$(group_of "$3")" -- "$1"
}

# link TARGET PLACE: a symbolic link, replaced in one step.
link() {
    if [[ -L $2 && $(readlink -- "$2") == "$1" ]]; then return; fi
    if [[ -e $2 && ! -L $2 ]]; then
        say "  ! $2 exists and is not a link: left as it is"
        return
    fi
    if [[ $2 == "$ROOT/current" ]]; then RESTART=yes; fi
    change "link $2 to $1" relink "$1" "$2"
}

relink() {
    ln -sfn -- "$1" "$2.new"
    mv -fT -- "$2.new" "$2"
}

booted() { [[ -d /run/systemd/system ]]; }

# ---- the machine ---------------------------------------------------------------------------------

check_machine() {
    if [[ $EUID -ne 0 && -z $DRY_RUN ]]; then fail "root is needed: sudo $0 ..."; fi
    [[ -x $PYTHON ]] || fail "$PYTHON is missing: sudo apt install python3 python3-venv"
    "$PYTHON" -c 'import struct, sys; sys.exit(struct.calcsize("P") != 8)' ||
        fail "rhot needs a 64-bit system (there are no 32-bit packages of OpenCV and Zenoh):" \
            "install the 64-bit Raspberry Pi OS"
    "$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
        fail "rhot needs Python 3.11 or newer, this is $("$PYTHON" --version):" \
            "Debian 12 or 13, or Raspberry Pi OS 12 or 13"
    command -v systemctl >/dev/null || fail "systemd is missing; rhot's services are its units"
}

has_package() { dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null | grep -qx installed; }

offered() { apt-cache show "$1" >/dev/null 2>&1; }

install_packages() {
    local missing=()
    "$PYTHON" -c 'import venv, ensurepip' 2>/dev/null || missing+=(python3-venv)
    if has_role pi && ! has_package python3-picamera2; then
        if offered python3-picamera2; then
            missing+=(python3-picamera2)
        else
            say "  ! this system offers no python3-picamera2: USB cameras and files only"
        fi
    fi
    ((${#missing[@]})) || return 0
    command -v apt-get >/dev/null || fail "${missing[*]} missing, and there is no apt to install it"
    change "install ${missing[*]} (apt)" apt_install "${missing[@]}"
}

apt_install() {
    apt-get install -y -qq --no-install-recommends "$@" >/dev/null ||
        { apt-get update -qq && apt-get install -y -qq --no-install-recommends "$@" >/dev/null; } ||
        fail "apt could not install $*; without a network, install it from the system's medium first"
}

make_user() {
    put "$HERE/sysusers.d/rhot.conf" "$SYSUSERS" 644 root
    if id -u rhot >/dev/null 2>&1; then return; fi
    change "make the user rhot" systemd-sysusers "$SYSUSERS"
}

# Applied to interfaces that appear later, too: udev does so.
set_network() {
    local before=$CHANGES
    put "$HERE/sysctl.d/rhot.conf" "$SYSCTL" 644 root
    if ((CHANGES > before)) && booted && [[ -z $DRY_RUN ]]; then
        systemctl restart systemd-sysctl.service || say "  ! $SYSCTL holds from the next start on"
    fi
}

make_folders() {
    folder "$ROOT" 755 root
    folder "$ROOT/versions" 755 root
    folder "$ETC" 755 root
    # Further rigs that this master serves: RIGS/NAME/rig.toml.
    if has_role master; then folder "$RIGS" 755 root; fi
    folder "$STATE" 755 root
    # The group may write: who calibrates by hand belongs to it. Files keep the group (2...).
    folder "$STATE/calibration" 2775 rhot
    folder "$STATE/recordings" 2775 rhot
    folder "$CACHE" 755 rhot
    link "$STATE/calibration" "$ETC/calibration"
    link "$STATE/recordings" "$ETC/recordings"
    local person=${SUDO_USER:-}
    if [[ -n $person && $person != root ]] && ! id -nG "$person" | grep -qw rhot; then
        change "let $person write calibrations (group rhot; from the next login)" \
            usermod -aG rhot "$person"
    fi
}

# ---- roles ---------------------------------------------------------------------------------------

ROLES='' CAMERAS='' MASTER='' SIMULATOR=''

has_role() { [[ " $ROLES " == *" $1 "* ]]; }

# What was installed before: a machine may be a Pi and the master in one.
read_installed() {
    local key value
    [[ -f $ROOT/installed ]] || return 0
    while IFS='=' read -r key value; do
        case $key in
            roles) ROLES=$value ;;
            cameras) CAMERAS=$value ;;
            master) MASTER=$value ;;
            simulator) SIMULATOR=$value ;;
        esac
    done <"$ROOT/installed"
}

add_role() { has_role "$1" || ROLES="${ROLES:+$ROLES }$1"; }

write_installed() {
    local new
    new=$(mktemp)
    printf 'roles=%s\ncameras=%s\nmaster=%s\nsimulator=%s\n' \
        "$ROLES" "$CAMERAS" "$MASTER" "$SIMULATOR" >"$new"
    put "$new" "$ROOT/installed" 644 root
    rm -f -- "$new"
}

extras() {
    local list=''
    if has_role pi; then list=pi; fi
    if has_role master || [[ -n $SIMULATOR ]]; then list="${list:+$list,}master"; fi
    printf '%s' "$list"
}

# ---- versions ------------------------------------------------------------------------------------

WHEELS='' WHEEL='' TEMPORARY=''

clean_up() {
    if [[ -n $TEMPORARY ]]; then rm -rf -- "$TEMPORARY"; fi
}
trap clean_up EXIT

pip_options() {
    if [[ -n $WHEELS ]]; then printf '%s\n' --no-index --find-links "$WHEELS"; fi
}

# Sets WHEEL: rhot's own wheel, from --wheels or built from the source tree this script lies in.
find_wheel() {
    local -a found=()
    if [[ -n $WHEELS ]]; then
        [[ -d $WHEELS ]] || fail "--wheels $WHEELS: no such folder"
        WHEELS=$(readlink -f -- "$WHEELS")
        mapfile -t found < <(find "$WHEELS" -maxdepth 1 -name 'rhot-*.whl' | sort -V)
        ((${#found[@]})) || fail "$WHEELS holds no wheel of rhot: \`make wheels\` collects all that is needed"
        WHEEL=${found[-1]}
        return
    fi
    if [[ -n $WHEEL ]]; then
        if [[ -d $WHEEL ]]; then WHEEL=$(find "$WHEEL" -maxdepth 1 -name 'rhot-*.whl' | sort -V | tail -n 1); fi
        [[ -f $WHEEL && $(basename -- "$WHEEL") == rhot-*.whl ]] || fail "--wheel: no wheel of rhot there"
        WHEEL=$(readlink -f -- "$WHEEL")
        return
    fi
    [[ -f $HERE/../pyproject.toml ]] ||
        fail "no source tree around $HERE: name a folder of wheels with --wheels DIR"
    TEMPORARY=$(mktemp -d)
    say "  (building rhot's wheel from $(readlink -f -- "$HERE/.."))"
    "$PYTHON" -m venv "$TEMPORARY/build"
    "$TEMPORARY/build/bin/pip" wheel --quiet --disable-pip-version-check --no-deps \
        --wheel-dir "$TEMPORARY" "$HERE/.." ||
        fail "rhot's wheel could not be built here (see above); build it elsewhere with \`make wheels\` and name the folder with --wheels"
    WHEEL=$(find "$TEMPORARY" -maxdepth 1 -name 'rhot-*.whl')
}

# The name of a version: its number, and a digest of all that goes in, so that a new build of the
# same number lies beside the old one.
version_name() {
    local number digest
    number=$(basename -- "$WHEEL" | cut -d- -f2)
    digest=$({
        sha256sum <"$WHEEL"
        if [[ -n $WHEELS ]]; then find "$WHEELS" -maxdepth 1 -name '*.whl' -printf '%f\n' | sort; fi
        "$PYTHON" --version
        extras
    } | sha256sum | cut -c1-8)
    printf '%s-%s' "$number" "$digest"
}

# make_version NAME: the virtual environment; .complete is written last.
make_version() {
    local place=$ROOT/versions/$1 flags=()
    if [[ -f $place/.complete ]]; then return; fi
    change "install rhot $1 into $place" build_version "$place"
}

build_version() {
    local place=$1 flags=()
    rm -rf -- "$place"
    # picamera2 and libcamera come from apt, and are not on PyPI for this.
    if has_role pi; then flags+=(--system-site-packages); fi
    "$PYTHON" -m venv "${flags[@]}" "$place"
    local -a options
    mapfile -t options < <(pip_options)
    "$place/bin/pip" install --quiet --disable-pip-version-check --no-warn-script-location \
        "${options[@]}" "rhot[$(extras)] @ file://$WHEEL" || {
        rm -rf -- "$place"
        fail "pip could not install rhot (see above); nothing was changed for the version that runs"
    }
    say "    markers are measured $(cd / && "$place/bin/python" -c \
        'from services.pi_tracker.compiled.library import state; print(state)')"
    cp -r -- "$HERE" "$place/deploy"
    touch "$place/.complete"
}

current_version() {
    if [[ -L $ROOT/current ]]; then basename -- "$(readlink -- "$ROOT/current")"; fi
}

# Compiled before the switch: what runs goes on with its own kernels meanwhile.
warm_kernels() {
    local place=$ROOT/versions/$1
    if [[ $(extras) != *master* || -f $place/.warm ]]; then return; fi
    change "compile the kernels (a minute or two, once per version)" run_warm "$place"
}

run_warm() {
    (cd / && runuser -u rhot -- env HOME="$STATE" RHOT_CACHE="$CACHE" nice -n 10 \
        "$1/bin/rhot" warm) | sed 's/^/    /'
    touch "$1/.warm"
}

# switch_to NAME: `current`, and the units that belong to it.
switch_to() {
    link "$ROOT/versions/$1" "$ROOT/current"
    put_units "$ROOT/versions/$1/deploy/systemd"
    if has_role master; then put_user_units "$ROOT/versions/$1/deploy/systemd-user"; fi
    if has_role master; then link "$ROOT/current/bin/rhot" "$COMMAND"; fi
}

put_units() {
    local from=$1 file
    if [[ -n $DRY_RUN ]]; then from=$HERE/systemd; fi
    folder "$UNITS/rhot-.service.d" 755 root
    while IFS= read -r -d '' file; do
        put "$from/$file" "$UNITS/$file" 644 root
    done < <(cd "$from" && find . -type f -printf '%P\0' | sort -z)
    for file in "$UNITS"/rhot-*.service; do
        if [[ -f $file && ! -f $from/${file##*/} ]]; then
            change "take away ${file##*/}, which this version does not have" retire "${file##*/}"
        fi
    done
}

# What it did, another unit does now: it is to be over before that starts.
retire() {
    if booted; then systemctl stop "$1"; fi
    systemctl disable --quiet "$1" 2>/dev/null || true
    rm -f -- "$UNITS/$1"
}

# Units that each user may start: SteamVR belongs to who is logged in.
put_user_units() {
    local from=$1 file
    if [[ -n $DRY_RUN ]]; then from=$HERE/systemd-user; fi
    for file in "$from"/*.service; do
        if [[ -f $file ]]; then put "$file" "$USER_UNITS/${file##*/}" 644 root; fi
    done
}

remember() {
    if [[ $(tail -n 1 "$ROOT/history" 2>/dev/null) == "$1" ]]; then return; fi
    if [[ -z $DRY_RUN ]]; then printf '%s\n' "$1" >>"$ROOT/history"; fi
}

# The versions that count for a rollback: those of the history that are still there, newest first.
kept_versions() {
    local name
    [[ -f $ROOT/history ]] || return 0
    tac "$ROOT/history" | awk '!seen[$0]++' | while IFS= read -r name; do
        if [[ -f $ROOT/versions/$name/.complete ]]; then printf '%s\n' "$name"; fi
    done
}

prune_versions() {
    local place kept
    # Not head, which would end the pipe early: an error to pipefail.
    kept=$(kept_versions | awk -v keep="$KEEP_VERSIONS" 'NR <= keep')
    for place in "$ROOT"/versions/*/; do
        place=${place%/}
        if [[ -d $place ]] && ! grep -qxF -- "${place##*/}" <<<"$kept"; then
            change "remove the old version ${place##*/}" remove_version "$place"
        fi
    done
}

remove_version() {
    local packages digest
    # The folder of its kernels carries a digest of the package's place (rhot/kernels/numba_cache.py).
    for packages in "$1"/lib/python3*/site-packages/services; do
        digest=$(printf %s "$packages" | sha256sum | cut -c1-8)
        rm -rf -- "$CACHE/rhot-kernels-$digest-"*
    done
    rm -rf -- "$1"
}

# ---- rig.toml and certificates -------------------------------------------------------------------

CONFIG='' PKI='' REPLACE=''

# rig_says QUESTION...: what rig.toml says, read by rhot itself (services/cli/deploy/rig_units.py).
rig_says() { "$ROOT/versions/$VERSION/bin/python" -m services.cli.deploy.rig_units "$@"; }

put_config() {
    if [[ -z $CONFIG ]]; then
        if [[ ! -f $ETC/rig.toml ]] && has_role pi && ! has_role master; then minimal_config; fi
        return
    fi
    if [[ -z $DRY_RUN ]]; then
        rig_says check "$CONFIG" >/dev/null || fail "--config: see above"
        if has_role master && [[ -z $REPLACE && -f $ETC/rig.toml ]]; then check_same_rig; fi
    fi
    if [[ -f $ETC/rig.toml ]] && ! cmp -s -- "$CONFIG" "$ETC/rig.toml"; then
        change "keep the old rig.toml as $ETC/rig.toml.bak" cp -p -- "$ETC/rig.toml" "$ETC/rig.toml.bak"
    fi
    put "$CONFIG" "$ETC/rig.toml" 644 root
    bring_calibration "$STATE/calibration"
}

# A second rig's file in the place of the first one's would end the first.
check_same_rig() {
    local here theirs
    here=$(rig_says name "$ETC/rig.toml" 2>/dev/null) || return 0
    theirs=$(rig_says name "$CONFIG")
    if [[ $here == "$theirs" ]]; then return; fi
    fail "this master serves the rig $here ($ETC/rig.toml), and --config is of the rig $theirs;" \
        "to serve both: install.sh rig $theirs --config FILE; to serve $theirs in the place of" \
        "$here: --replace"
}

# What lies in calibration/ beside --config. Results of this machine are never replaced.
bring_calibration() {
    local file
    for file in "$(dirname -- "$CONFIG")"/calibration/*.json; do
        if [[ -f $file && ! -e $1/${file##*/} ]]; then put "$file" "$1/${file##*/}" 644 rhot; fi
    done
}

# A Pi without the rig's rig.toml: enough for its tracker.
minimal_config() {
    local new camera endpoint
    [[ -n $MASTER ]] || fail "name the rig's rig.toml with --config, or the master with --master HOST"
    endpoint="tcp/$MASTER:7447"
    if [[ -n $PKI ]]; then endpoint="tls/$MASTER:7448"; fi
    new=$(mktemp)
    {
        printf '# Made by install.sh. The rig has one rig.toml for all machines: replace this one by it.\n'
        printf '[bus]\nconnect = ["%s"]\n' "$endpoint"
        if [[ -n $PKI ]]; then printf 'certificates = "pki"\n'; fi
        for camera in $CAMERAS; do printf '\n[[camera]]\nname = "%s"\nsource = "picamera2"\n' "$camera"; done
    } >"$new"
    put "$new" "$ETC/rig.toml" 644 root
    rm -f -- "$new"
}

# put_certificates FOLDER: those of --pki.
put_certificates() {
    local name mode
    [[ -n $PKI ]] || return 0
    for name in ca.pem own.pem own.key; do
        [[ -f $PKI/$name ]] || fail "--pki $PKI: $name is missing; it holds ca.pem, own.pem and own.key of one machine"
    done
    folder "$1" 750 rhot
    for name in ca.pem own.pem own.key; do
        mode=644
        if [[ $name == own.key ]]; then mode=600; fi
        put "$PKI/$name" "$1/$name" "$mode" rhot
    done
}

# A machine without the certificate that its rig.toml calls for gets no session.
check_certificates() {
    if [[ -n $DRY_RUN || ! -f $1/rig.toml || -f $1/pki/own.key ]]; then return; fi
    if [[ -n $(rig_says secured "$1/rig.toml") ]]; then
        say "  ! $1/rig.toml has a tls endpoint, and $1/pki holds no certificate of this machine:"
        say "    make it with \`rhot pki init\`, and give its folder with --pki"
    fi
}

# What --master says against what rig.toml says: a Pi that looks for another master never speaks.
check_master() {
    if [[ -z $MASTER || -n $DRY_RUN || ! -f $ETC/rig.toml ]]; then return; fi
    if ! rig_says connect "$ETC/rig.toml" | grep -qF -- "/$MASTER:"; then
        say "  ! $ETC/rig.toml does not connect to $MASTER, but to $(rig_says connect "$ETC/rig.toml" | paste -sd' '):"
        say "    correct its [bus] connect, or give the rig's file with --config"
    fi
}

# ---- units ---------------------------------------------------------------------------------------

targets() {
    local role
    for role in $ROLES; do printf 'rhot-%s.target\n' "$role"; done
}

# Units of this machine's roles, one a line; without a rig.toml those that every rig has.
wanted_units() {
    local camera rig
    if has_role master; then
        if [[ -f $ETC/rig.toml && -z $DRY_RUN ]]; then
            rig_says units "$ETC/rig.toml" "$RIGS"
            for rig in $(rig_names); do units_of_rig "$rig"; done
        else
            printf 'rhot-%s.service\n' router fusion viewer
        fi
    fi
    for camera in $CAMERAS; do printf 'rhot-pi-tracker@%s.service\n' "$camera"; done
    if [[ -n $SIMULATOR ]]; then printf '%s\n' rhot-simulator.service; fi
}

enable_units() {
    local unit
    local -a missing=()
    while IFS= read -r unit; do
        if [[ -n $DRY_RUN || $(systemctl is-enabled "$unit" 2>/dev/null) != enabled ]]; then
            missing+=("$unit")
        fi
    done < <({ targets; wanted_units; } | sort -u)
    ((${#missing[@]})) || return 0
    change "start with the machine: ${missing[*]}" systemctl enable --quiet "${missing[@]}"
}

start_units() {
    if ! booted; then
        say "  (systemd does not run here: everything starts with the machine)"
        return
    fi
    if [[ -n $NO_START ]]; then return; fi
    if [[ ! -f $ETC/rig.toml ]]; then return; fi
    local unit
    local -a running=() stopped=()
    while IFS= read -r unit; do
        if [[ $unit != *.target && $(systemctl is-active "$unit") =~ ^(active|activating|reloading)$ ]]; then
            running+=("$unit")
        elif ! systemctl is-active --quiet "$unit"; then
            stopped+=("$unit")
        fi
    done < <({ targets; wanted_units; } | sort -u)
    if [[ -z $DRY_RUN ]]; then systemctl daemon-reload; fi
    if [[ -n $RESTART ]] && ((${#running[@]})); then
        change "start again ${running[*]}" begin restart "${running[@]}"
    fi
    if ((${#stopped[@]})); then change "start ${stopped[*]}" begin start "${stopped[@]}"; fi
}

# begin start|restart UNIT...: systemctl does not wait (a service that waits for its router is in
# order); after ten seconds it is said how far they are.
begin() {
    local _ unit
    systemctl reset-failed 'rhot-*' 2>/dev/null || true
    systemctl "$1" --no-block "${@:2}"
    for _ in {1..20}; do
        sleep 0.5
        if systemctl is-active --quiet "${@:2}"; then return; fi
    done
    for unit in "${@:2}"; do
        systemctl is-active --quiet "$unit" || say "    $unit: $(state_of "$unit")"
    done
}

state_of() {
    local state text
    state=$(systemctl show -P ActiveState "$1" 2>/dev/null || true)
    text=$(systemctl show -P StatusText "$1" 2>/dev/null || true)
    printf '%s%s' "${state:-unknown}" "${text:+ ($text)}"
}

# ---- commands ------------------------------------------------------------------------------------

VERSION='' NO_START=''

# A new version beside the old ones, then everything that should be as the roles say.
install_all() {
    check_machine
    install_packages
    make_user
    set_network
    make_folders
    if [[ -n $DRY_RUN && -z $WHEELS$WHEEL ]]; then
        VERSION=new
    else
        find_wheel
        VERSION=$(version_name)
    fi
    make_version "$VERSION"
    put_config
    put_certificates "$ETC/pki"
    check_certificates "$ETC"
    check_master
    warm_kernels "$VERSION"
    switch_to "$VERSION"
    write_installed
    remember "$VERSION"
    enable_units
    start_units
    prune_versions
    finish
}

finish() {
    if ((CHANGES == 0)); then
        say "Nothing to do: rhot $VERSION is installed as $ROLES."
        return
    fi
    if [[ -n $DRY_RUN ]]; then
        say "A dry run: nothing was done."
        return
    fi
    say "rhot $VERSION is installed as $ROLES."
    next_steps
}

next_steps() {
    say "What comes next:"
    if [[ ! -f $ETC/rig.toml ]]; then
        say "  write $ETC/rig.toml (copy config/rig.example.toml), then run this again with --config"
    elif has_role master; then
        say "  rhot check $ETC/rig.toml          is everything there?"
        say "  rhot top --config $ETC/rig.toml   what runs, at what rate"
        user_steps
    else
        say "  on the master: rhot top --config $ETC/rig.toml shows this camera within seconds"
    fi
    say "  journalctl -fu 'rhot-*'                what the services say"
    say "  sudo $ROOT/current/deploy/install.sh status | rollback | uninstall"
}

user_steps() {
    local unit
    for unit in $(rig_says user-units "$ETC/rig.toml"); do
        say "  systemctl --user enable --now $unit   as the user of SteamVR"
    done
}

install_role() {
    local role=$1
    shift
    local -a names=()
    while (($#)); do
        case $1 in
            --master | --config | --pki | --wheels | --wheel)
                (($# > 1)) || fail "$1 needs a value"
                case $1 in
                    --master) MASTER=$2 ;;
                    --config) CONFIG=$2 ;;
                    --pki) PKI=$2 ;;
                    --wheels) WHEELS=$2 ;;
                    --wheel) WHEEL=$2 ;;
                esac
                shift
                ;;
            --simulator) SIMULATOR=yes ;;
            --replace) REPLACE=yes ;;
            --no-start) NO_START=yes ;;
            --dry-run) DRY_RUN=yes ;;
            -*) fail "unknown option $1; see install.sh --help" ;;
            *) names+=("$1") ;;
        esac
        shift
    done
    check_arguments "$role" "${names[@]}"
    if [[ -n $role ]]; then add_role "$role"; fi
    if ((${#names[@]})); then CAMERAS="${names[*]}"; fi
    lock
    install_all
}

check_arguments() {
    local role=$1 name
    shift
    if [[ $role == pi ]]; then
        (($#)) || fail "which camera? e.g. install.sh pi left --master 192.168.1.10"
        [[ -n $MASTER || -n $CONFIG || -f $ETC/rig.toml ]] ||
            fail "where is the master? --master HOST, or the rig's rig.toml with --config FILE"
    elif (($#)); then
        fail "unexpected $1; see install.sh --help"
    fi
    for name in "$@"; do
        [[ $name =~ ^[A-Za-z0-9][A-Za-z0-9_-]*$ ]] || fail "$name is no name of a camera"
    done
    local host_name='^[][A-Za-z0-9.:_-]+$'
    [[ -z $MASTER || $MASTER =~ $host_name ]] || fail "--master $MASTER is no host"
    [[ -z $CONFIG || -f $CONFIG ]] || fail "--config $CONFIG: no such file"
    [[ -z $PKI || -d $PKI ]] || fail "--pki $PKI: no such folder"
}

lock() {
    if [[ -n $DRY_RUN ]]; then return; fi
    if [[ $EUID -ne 0 ]]; then fail "root is needed: sudo $0 ..."; fi
    exec 9>/run/lock/rhot-install.lock
    flock -n 9 || fail "another install.sh is running"
}

# ---- further rigs of a master --------------------------------------------------------------------

# Beside each other as /etc/rhot has it for the first rig; router, fusion, solver, object tracker and
# viewer read all of them when they start.
one_rig() {
    local name=${1:-} place remove=''
    [[ $name =~ ^[A-Za-z0-9][A-Za-z0-9_-]*$ ]] ||
        fail "which rig? install.sh rig NAME --config FILE; NAME of letters, digits, - and _"
    shift
    while (($#)); do
        case $1 in
            --config | --pki)
                (($# > 1)) || fail "$1 needs a value"
                if [[ $1 == --config ]]; then CONFIG=$2; else PKI=$2; fi
                shift
                ;;
            --remove) remove=yes ;;
            --dry-run) DRY_RUN=yes ;;
            *) fail "unexpected $1; see install.sh --help" ;;
        esac
        shift
    done
    place=$RIGS/$name
    check_arguments '' # --config and --pki
    has_role master || fail "rhot is not installed as the master here: install.sh master ..."
    [[ -n $remove || -n $CONFIG ]] || fail "install.sh rig $name --config FILE: its rig.toml"
    lock
    VERSION=$(current_version)
    if [[ -n $remove ]]; then
        [[ -d $place ]] || fail "there is no rig $name here:$(rigs_said)"
        RESTART=yes
        change "stop what is its own" stop_rig "$name"
        change "remove $place" rm -rf -- "$place"
        say "  (its calibrations and recordings stay in $STATE/rigs/$name)"
    else
        put_rig "$place" "$STATE/rigs/$name"
    fi
    enable_units
    start_units
    if ((CHANGES == 0)); then say "Nothing to do: $name is as it should be."; fi
}

# put_rig PLACE DATA
put_rig() {
    local kind
    rig_says check "$CONFIG" >/dev/null || fail "--config: see above"
    folder "$1" 755 root
    for kind in calibration recordings; do
        folder "$2/$kind" 2775 rhot
        link "$2/$kind" "$1/$kind"
    done
    bring_calibration "$2/calibration"
    put_certificates "$1/pki"
    put "$CONFIG" "$1/rig.toml" 644 root
    check_certificates "$1"
    if [[ -n $DRY_RUN ]]; then return; fi
    # Says which rig does not fit the others, and why.
    "$ROOT/current/bin/rhot" router --print --config "$ETC/rig.toml" --config "$RIGS" >/dev/null ||
        fail "see above"
}

stop_rig() {
    local -a units
    mapfile -t units < <(units_of_rig "$1")
    systemctl disable --quiet "${units[@]}" 2>/dev/null || true
    if booted; then systemctl stop "${units[@]}"; fi
}

# What a further rig has to itself: its page records and calibrates.
units_of_rig() { printf 'rhot-%s.service\n' "recorder@$1" "calibrator@$1"; }

# Names of further rigs, one a line.
rig_names() {
    local place
    for place in "$RIGS"/*/; do
        if [[ -d $place ]]; then basename -- "$place"; fi
    done
}

rigs_said() {
    local names
    names=$(rig_names | paste -sd' ')
    printf ' %s' "${names:-none but that of $ETC/rig.toml}"
}

# ---- new versions, status, removal ---------------------------------------------------------------

upgrade() {
    [[ -n $ROLES ]] || fail "rhot is not installed here: install.sh pi ... or install.sh master"
    install_role '' "$@"
}

rollback() {
    local before
    lock
    before=$(kept_versions | grep -vxF -- "$(current_version)" | head -n 1 || true)
    [[ -n $before ]] || fail "there is no earlier version than $(current_version) here"
    VERSION=$before
    say "Back to rhot $before:"
    switch_to "$before"
    # The version that is left goes from the history, or a second rollback would return to it.
    grep -vxF -- "$before" "$ROOT/history" | head -n -1 >"$ROOT/history.new" || true
    printf '%s\n' "$before" >>"$ROOT/history.new"
    mv -f -- "$ROOT/history.new" "$ROOT/history"
    # The version before may have units that the one after it did without.
    enable_units
    start_units
    say "rhot $before runs again. \`install.sh upgrade\` goes forward."
}

status() {
    local unit name
    [[ -n $ROLES ]] || { say "rhot is not installed here."; return; }
    say "roles: $ROLES${CAMERAS:+; cameras: $CAMERAS}${MASTER:+; master: $MASTER}"
    if has_role master; then say "further rigs:$(rigs_said)"; fi
    for name in $(kept_versions); do
        if [[ $name == "$(current_version)" ]]; then say "version $name (current)"; else say "version $name"; fi
    done
    VERSION=$(current_version)
    while IFS= read -r unit; do
        if booted; then say "$unit: $(state_of "$unit")"; else say "$unit: $(systemctl is-enabled "$unit" 2>/dev/null || true)"; fi
    done < <({ targets; wanted_units; } | sort -u)
}

uninstall() {
    local purge='' file unit
    while (($#)); do
        case $1 in
            --purge) purge=yes ;;
            --dry-run) DRY_RUN=yes ;;
            *) fail "unknown option $1; see install.sh --help" ;;
        esac
        shift
    done
    lock
    local -a units=()
    for file in "$UNITS"/rhot-*.target "$UNITS"/rhot-*.service; do
        if [[ -f $file ]]; then units+=("${file##*/}"); fi
    done
    for unit in $CAMERAS; do units+=("rhot-pi-tracker@$unit.service"); done
    if ((${#units[@]})); then
        if booted; then change "stop rhot" systemctl stop 'rhot-*.target' 'rhot-*.service'; fi
        change "forget its units" forget_units "${units[@]}"
    fi
    if [[ -L $COMMAND && $(readlink -- "$COMMAND") == "$ROOT"/* ]]; then change "remove $COMMAND" rm -f -- "$COMMAND"; fi
    for file in "$ROOT" "$CACHE" "$SYSUSERS" "$SYSCTL" "$USER_UNITS"/rhot-*.service; do
        if [[ -e $file ]]; then change "remove $file" rm -rf -- "$file"; fi
    done
    if [[ -z $purge ]]; then
        if [[ -e $ETC || -e $STATE ]]; then say "$ETC and $STATE (calibrations, recordings) stay; --purge removes them."; fi
    else
        for file in "$ETC" "$STATE"; do
            if [[ -e $file ]]; then change "remove $file" rm -rf -- "$file"; fi
        done
        if id -u rhot >/dev/null 2>&1; then change "remove the user rhot" userdel rhot; fi
    fi
    if ((CHANGES)); then say "rhot is removed."; else say "Nothing to do: rhot is not installed here."; fi
}

forget_units() {
    systemctl disable --quiet "$@" 2>/dev/null || true
    rm -rf -- "$UNITS"/rhot-*.service "$UNITS"/rhot-*.target "$UNITS/rhot-.service.d" \
        "$UNITS"/rhot-*.target.wants
    if booted; then
        systemctl daemon-reload
        systemctl reset-failed 'rhot-*' 2>/dev/null || true
    fi
}

main() {
    local command=${1:---help}
    if (($#)); then shift; fi
    read_installed
    case $command in
        pi | master) install_role "$command" "$@" ;;
        rig) one_rig "$@" ;;
        upgrade) upgrade "$@" ;;
        rollback) rollback ;;
        status) status ;;
        uninstall) uninstall "$@" ;;
        -h | --help | help) usage ;;
        *) fail "unknown command $command; pi, master, rig, upgrade, rollback, status or uninstall" ;;
    esac
}

main "$@"
