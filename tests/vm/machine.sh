# shellcheck shell=bash disable=SC2154
# Building blocks of run_vm_test. Variables: work (folder that is kept), box (folder of this run), here.

skip() {
  echo "SKIPPED: $*"
  exit 77
}

need() {
  PATH=$PATH:/usr/sbin:/sbin
  local tool
  for tool in "$@"; do command -v "$tool" > /dev/null || skip "$tool is not installed"; done
  # A busybox that needs shared libraries would not start in the empty machine.
  ! ldd "$(command -v busybox)" > /dev/null 2>&1 || skip "busybox is not static (package busybox-static)"
}

# Debian's stock kernel and its modules, unpacked in $work/kernel. Sets `modules` and `version`.
get_kernel() {
  modules=$work/kernel
  exec 9> "$work/lock"
  flock 9
  if [[ ! -f $modules/vmlinux ]]; then
    local package
    package=$(apt-cache depends linux-image-amd64 2> /dev/null | awk '/Depends: linux-image/ { print $2; exit }')
    [[ -n $package ]] || skip "the package archive does not know linux-image-amd64 (apt-get update?)"
    rm -rf "$work/fetch" "$modules.new"
    mkdir -p "$work/fetch"
    (cd "$work/fetch" && apt-get -q download "$package") || skip "cannot download $package"
    dpkg-deb -x "$work/fetch/$package"_*.deb "$modules.new"
    rm -rf "$work/fetch"
    depmod -b "$modules.new" "$(ls "$modules.new/lib/modules")"
    unpack_kernel "$modules.new"/boot/vmlinuz-* "$modules.new/vmlinux"
    rm -rf "$modules"
    mv "$modules.new" "$modules"
  fi
  flock -u 9
  version=$(ls "$modules/lib/modules")
}

# The ELF image inside a compressed kernel: QEMU boots it at once, while unpacking it in the machine takes ten seconds.
unpack_kernel() {
  local offset
  for offset in $(LC_ALL=C grep -obUaP '\xfd7zXZ\x00' "$1" | cut -d: -f1); do
    tail -c +$((offset + 1)) "$1" | xz -dc > "$2" 2> /dev/null || true # what follows the image is no xz
    [[ $(head -c 4 "$2" | tail -c 3) == ELF ]] && return
  done
  cp "$1" "$2"
}

# make_initrd GUEST_SCRIPT "MODULES" PROGRAM...: the machine's whole file system, in $box/initrd.
make_initrd() {
  local script=$1 wanted=$2 root=$box/root module file
  shift 2
  mkdir -p "$root"/{bin,dev,proc,sys,tmp,modules,usr/bin}
  cp "$(command -v busybox)" "$root/bin/busybox"
  for file in sh mount insmod cat echo sleep ls uname poweroff; do ln -s busybox "$root/bin/$file"; done
  cp "$here/guest_init" "$root/init"
  cp "$script" "$root/test.sh"
  for module in $wanted; do
    modprobe -d "$modules" -S "$version" --show-depends "$module" | awk '/^insmod/ { print $2 }'
  done | awk '!seen[$0]++' | while read -r file; do
    cp "$file" "$root/modules/"
    basename "$file" >> "$root/modules/order"
  done
  for file in "$(command -v ip)" "$@"; do add_program "$root" "$file"; done
  (cd "$root" && find . | cpio -o -H newc --quiet --owner=0:0 | gzip -1 > "$box/initrd")
}

# A program with the shared libraries that it needs.
add_program() {
  cp -L "$2" "$1/usr/bin/"
  ldd "$2" 2> /dev/null | grep -oE '/[^ ]+' | while read -r library; do
    mkdir -p "$1$(dirname "$library")"
    cp -nL "$library" "$1$library"
  done
}

# boot QEMU_OPTIONS...: runs the machine to its end, shows its console, exits with the code that the guest reports.
boot() {
  local code
  timeout --foreground 240 qemu-system-x86_64 -accel tcg,thread=multi -cpu max -smp 2 -m 512 -machine q35 \
    -nodefaults -no-user-config -no-reboot -display none -serial "file:$box/console" \
    -kernel "$modules/vmlinux" -initrd "$box/initrd" -append "console=ttyS0 quiet panic=-1" "$@" < /dev/null ||
    echo "QEMU ended with code $?"
  tr -d '\r' < "$box/console"
  code=$(tr -d '\r' < "$box/console" | sed -n 's/^VM-RC=\([0-9]*\)$/\1/p' | tail -n 1)
  echo "The machine reports ${code:-nothing} after $SECONDS s."
  exit "${code:-1}"
}

# Waits for a line of the console; false when the machine has gone or nothing comes for two minutes.
await() {
  local _
  for _ in $(seq 1200); do
    if grep -qs "$1" "$box/console"; then return; fi
    if [[ ! -d $box ]]; then return 1; fi
    sleep 0.1
  done
  return 1
}

# Pulls the serial adapter when the guest is ready for that, and plugs in another one later.
pull_and_plug() {
  exec 8> "$box/monitor.in"
  await READY-UNPLUG || return 0
  echo "device_del adapter0" >&8
  await READY-REPLUG || return 0
  # QEMU may still be busy with the old one; it refuses a second device of the same name.
  until grep -qs -e 'connected again' -e VM-RC= "$box/console"; do
    [[ -d $box ]] || return 0
    echo "device_add usb-serial,id=adapter1,chardev=hand,bus=usb.0" >&8
    sleep 1
  done
  await VM-RC= || return 0 # the pipe stays open as long as the machine runs
}
