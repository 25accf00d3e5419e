#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/geom/arrays/set_values.h"
#include "tactus/tissue/embed_kernels.h"
#include "tactus/tissue/node_check_kernels.h"
#include "tactus/tissue/rigid_motion_kernels.h"
#include "tactus/tissue/summary_kernels.h"
#include "tactus/tissue/topology_kernels.h"

TACTUS_CUDA_KERNEL(tactus::embed::MoveVertices);
TACTUS_CUDA_KERNEL(tactus::embed::GatherNormals);
TACTUS_CUDA_KERNEL(tactus::SetValues<tactus::embed::Anchor>);
TACTUS_CUDA_KERNEL(tactus::embed::SetTriangles);
TACTUS_CUDA_KERNEL(tactus::SetValues<tactus::embed::CubeNodes>);
TACTUS_CUDA_KERNEL(tactus::SumMotion);
TACTUS_CUDA_KERNEL(tactus::CheckNodes);
TACTUS_CUDA_KERNEL(tactus::ClearRecords);
TACTUS_CUDA_KERNEL(tactus::SummariseNodeCheck);
TACTUS_CUDA_KERNEL(tactus::SummariseExtremes);
TACTUS_CUDA_KERNEL(tactus::cut::ClearCubes);
TACTUS_CUDA_KERNEL(tactus::cut::AddCopies);
TACTUS_CUDA_KERNEL(tactus::cut::SetCellMasses);
TACTUS_CUDA_KERNEL(tactus::cut::SetNodeMasses);
TACTUS_CUDA_KERNEL(tactus::cut::PlaceNodes);
TACTUS_CUDA_KERNEL(tactus::cut::SetMasses);
TACTUS_CUDA_KERNEL(tactus::cut::SetHeldNodes);
