#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/sim/real_film_kernels.h"

TACTUS_CUDA_KERNEL(tactus::FindRealFilm);
TACTUS_CUDA_KERNEL(tactus::FindNearRealFilm);
TACTUS_CUDA_KERNEL(tactus::CountRealFilm);
TACTUS_CUDA_KERNEL(tactus::TagRealFilm);
TACTUS_CUDA_KERNEL(tactus::MoveRealFilm);
TACTUS_CUDA_KERNEL(tactus::PoseRealFilm);
