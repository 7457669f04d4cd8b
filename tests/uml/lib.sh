# shellcheck shell=bash
# Functions shared by the scripts of the test runner; sourced, never run.

say() { printf '%s\n' "$*" >&2; }

die() {
    local status=$1
    shift
    say "$*"
    exit "$status"
}

have() { command -v "$1" >/dev/null 2>&1; }

# Debian keeps ip, modprobe and linux.uml where a plain user's PATH may not look.
PATH=$PATH:/usr/sbin:/sbin

as_root() {
    if ((EUID == 0)); then
        "$@"
    elif ! have sudo; then
        say "cannot run as root: $* (not root, and there is no sudo)"
        return 1
    elif [[ -n ${CI:-} || ! -t 0 ]]; then
        sudo -n "$@"
    else
        sudo "$@"
    fi
}

# apt_install PACKAGE...: a failed list update is not fatal by itself: the list at hand may do.
apt_install() {
    have apt-get || {
        say "cannot install $*: there is no apt-get here"
        return 1
    }
    say "installing: $*"
    as_root apt-get -qq update || say "apt-get update failed; going on with the package list at hand"
    as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get -qq install -y --no-install-recommends "$@" >/dev/null
}

# need COMMAND PACKAGE...: installs the packages when the command is missing.
need() {
    local command=$1
    shift
    have "$command" || apt_install "$@"
}

# Where `newer-kernel` puts its own.
newer_kernel_place() { printf '%s/target/tools/uml' "$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"; }

newer_kernel_works() {
    local place
    place=$(newer_kernel_place)
    [[ $(cat "$place/works" 2>/dev/null) == "$place" ]]
}
