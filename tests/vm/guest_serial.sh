# In the machine: the Mia driver on an emulated FTDI adapter that is pulled and plugged in again.
i=0
while [ ! -e /dev/ttyUSB0 ] && [ $i -lt 100 ]; do sleep 0.1; i=$((i + 1)); done
vm_serial_test /dev/ttyUSB0
