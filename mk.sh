set -e
cd /tmp/st
cmake -DOUTPUT=/tmp/st/embedded_sources.cpp "-DSOURCES=$(ls -1 $PWD/kernels/*.cl $PWD/kernels/core/*.inc $PWD/shaders/*.comp $PWD/shaders/*.glsl 2>/dev/null | tr '\n' '|' | sed 's/|$//')" -DROOT=$PWD -P host/embed.cmake
F="-std=c++20 -O2 -Wall -Wextra -Wpedantic -Ihost -Ihost/include -Ikernels/core"
mkdir -p /tmp/st/o
for f in host/program.cpp host/opencl/*.cpp host/api/device.cpp host/api/interrogator.cpp host/api/device_interrogation.cpp host/api/rays.cpp host/api/values.cpp host/api/camera.cpp host/fields/volume.cpp host/surfaces/*.cpp /tmp/st/embedded_sources.cpp; do o=/tmp/st/o/$(basename $f .cpp).o; ccache g++ $F -c $f -o $o; done
ccache g++ $F -DSTUB_VULKAN -DSTUB_REF -c /tmp/lead/stub.cpp -o /tmp/st/o/stub.o
ccache g++ $F -c /tmp/st/proto.cpp -o /tmp/st/o/proto.o
g++ /tmp/st/o/*.o -o /tmp/st/proto -lOpenCL -lfmt -lpthread
