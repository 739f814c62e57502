# In the machine: the CAN tests on a virtual interface, then between two emulated controllers at 1 Mbit/s.
set -e
ip=/usr/bin/ip # by its path: the shell would take the one of busybox, which knows no CAN
$ip link add dev vcan0 type vcan
$ip link set vcan0 up
EMBODY_CAN_HOST=vcan0 EMBODY_CAN_HAND=vcan0 vm_can_test
for i in can0 can1; do
  $ip link set "$i" type can bitrate 1000000 restart-ms 100
  $ip link set "$i" up
done
EMBODY_CAN_HOST=can0 EMBODY_CAN_HAND=can1 vm_can_test
