#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/geom/arrays/index_lists.h"
#include "tactus/geom/arrays/tile_scan_kernels.h"
#include "tactus/geom/search/cell_list_kernels.h"
#include "tactus/geom/search/cell_sort_kernels.h"
#include "tactus/geom/search/neighbour_list_kernels.h"
#include "tactus/geom/search/reorder_kernels.h"

TACTUS_CUDA_KERNEL(tactus::CellBounds);
TACTUS_CUDA_KERNEL(tactus::ClearCells);
TACTUS_CUDA_KERNEL(tactus::CountInCells<tactus::HashedNumbers>);
TACTUS_CUDA_KERNEL(tactus::CountInCells<tactus::WrappedNumbers>);
TACTUS_CUDA_KERNEL(tactus::SumTile);
TACTUS_CUDA_KERNEL(tactus::ScanTile);
TACTUS_CUDA_KERNEL(tactus::SpreadKeys);
TACTUS_CUDA_KERNEL(tactus::SpreadNumbers);
TACTUS_CUDA_KERNEL(tactus::SortParticles);
TACTUS_CUDA_KERNEL(tactus::SortNumbers);
TACTUS_CUDA_KERNEL(tactus::ReorderFields);
TACTUS_CUDA_KERNEL(tactus::SetValues<tactus::IndexRange>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::CountNeighbours>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::WriteNeighbours>);
