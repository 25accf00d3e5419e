#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/reconstruct/depth/depth_kernels.h"
#include "tactus/reconstruct/depth/depth_seam_kernels.h"
#include "tactus/reconstruct/hull_check_kernels.h"
#include "tactus/reconstruct/hull_kernels.h"
#include "tactus/reconstruct/silhouette_kernels.h"
#include "tactus/reconstruct/texture/view_score_kernels.h"
#include "tactus/reconstruct/tolerant_kernels.h"
#include "tactus/reconstruct/view_count_kernels.h"

TACTUS_CUDA_KERNEL(tactus::PrepareSilhouettes);
TACTUS_CUDA_KERNEL(tactus::SumCellColumns);
TACTUS_CUDA_KERNEL(tactus::PrepareWindows);
TACTUS_CUDA_KERNEL(tactus::SortRegions);
TACTUS_CUDA_KERNEL(tactus::ClassifyBricks);
TACTUS_CUDA_KERNEL(tactus::AssignSlots);
TACTUS_CUDA_KERNEL(tactus::FetchGhosts);
TACTUS_CUDA_KERNEL(tactus::BrickSigns);
TACTUS_CUDA_KERNEL(tactus::TolerantSigns);
TACTUS_CUDA_KERNEL(tactus::EmitTolerantVertices);
TACTUS_CUDA_KERNEL(tactus::BlameSamples);
TACTUS_CUDA_KERNEL(tactus::CountBlame);
TACTUS_CUDA_KERNEL(tactus::VoteViews);
TACTUS_CUDA_KERNEL(tactus::ClearUnseen);
TACTUS_CUDA_KERNEL(tactus::MarkTiles);
TACTUS_CUDA_KERNEL(tactus::PrepareDepth);
TACTUS_CUDA_KERNEL(tactus::FindHoles);
TACTUS_CUDA_KERNEL(tactus::FadeDepth);
TACTUS_CUDA_KERNEL(tactus::VoteDepth);
TACTUS_CUDA_KERNEL(tactus::DepthSigns);
