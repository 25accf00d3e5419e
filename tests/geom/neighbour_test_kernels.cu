#include "geom/neighbour_test_kernels.h"
#include "tactus/compute/cuda/kernel_launch.cuh"

TACTUS_CUDA_KERNEL(tactus::test::CollectNear);
TACTUS_CUDA_KERNEL(tactus::test::CollectLists);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::test::OrderedSum>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::test::OrderedSum, tactus::ListUse::write>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::test::OrderedSum, tactus::ListUse::read>);
