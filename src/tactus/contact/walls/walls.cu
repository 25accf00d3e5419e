#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/contact/walls/active_wall_kernels.h"
#include "tactus/contact/walls/body_wall_kernels.h"
#include "tactus/contact/walls/near_wall_kernels.h"
#include "tactus/contact/walls/wall_find_kernels.h"
#include "tactus/contact/walls/wall_grid_kernels.h"

TACTUS_CUDA_KERNEL(tactus::FindNearWalls);
TACTUS_CUDA_KERNEL(tactus::PoseActiveVertices);
TACTUS_CUDA_KERNEL(tactus::WatchNodes);
TACTUS_CUDA_KERNEL(tactus::StartActive);
TACTUS_CUDA_KERNEL(tactus::PoseInactiveVertices);
TACTUS_CUDA_KERNEL(tactus::ChooseActive);
TACTUS_CUDA_KERNEL(tactus::GuardCells);
TACTUS_CUDA_KERNEL(tactus::NoteNodes);
TACTUS_CUDA_KERNEL(tactus::CopyWallVertices);
TACTUS_CUDA_KERNEL(tactus::AddWallImpulses);
TACTUS_CUDA_KERNEL(tactus::MarkCells);
TACTUS_CUDA_KERNEL(tactus::SpreadMarks);
TACTUS_CUDA_KERNEL(tactus::ListNearTriangles);
TACTUS_CUDA_KERNEL(tactus::PoseNearTriangles);
TACTUS_CUDA_KERNEL(tactus::FindBodyWalls);
TACTUS_CUDA_KERNEL(tactus::ChooseNearParticles);
TACTUS_CUDA_KERNEL(tactus::PushVertices);
TACTUS_CUDA_KERNEL(tactus::PushCorners);
TACTUS_CUDA_KERNEL(tactus::PushListedCorners);
TACTUS_CUDA_KERNEL(tactus::GatherAtNodes);
TACTUS_CUDA_KERNEL(tactus::PushNodes);
