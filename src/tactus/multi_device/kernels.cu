#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/multi_device/peer_trial_kernels.h"

TACTUS_CUDA_KERNEL(tactus::ReadPeer);
