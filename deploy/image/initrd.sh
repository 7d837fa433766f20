#!/bin/busybox sh
# Finds the slot that the boot loader has chosen (imprint.root=NAME, a partition's name) and starts from it, read-only.
/bin/busybox --install -s /bin
export PATH=/bin
mount -t proc proc /proc && mount -t sysfs sysfs /sys && mount -t devtmpfs dev /dev
while read -r module; do insmod "/modules/$module" 2>/dev/null; done </modules.list
for word in $(cat /proc/cmdline); do
  case $word in imprint.root=*) name=${word#imprint.root=} ;; esac
done
tries=0
while [ $tries -lt 100 ]; do
  for event in /sys/class/block/*/uevent; do
    grep -qx "PARTNAME=$name" "$event" || continue
    device=/dev/$(sed -n 's/^DEVNAME=//p' "$event")
    mount -t squashfs -o ro "$device" /root && break 2
  done
  tries=$((tries + 1))
  sleep 0.1
done
if ! [ -e /root/usr/lib/systemd/systemd ]; then
  echo "no root on a partition named $name: restarting, the boot loader takes the other slot"
  sleep 2
  reboot -f
fi
mount --move /dev /root/dev
umount /sys /proc
exec switch_root /root /sbin/init
