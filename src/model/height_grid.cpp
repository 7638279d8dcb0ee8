#include "train_derail/model/height_grid.hpp"

#include "train_derail/inputs/terrain_grid.hpp"

namespace train_derail::model {

HeightGrid::HeightGrid(const inputs::TerrainGrid& grid)
    : spacing_(grid.spacing),
      x_from_(grid.x_from),
      y_from_(grid.y_from),
      highest_(-inputs::kInfinity),
      along_(grid.rows.size()),
      across_(0) {
  for (const inputs::TerrainGridRow& row : grid.rows) {
    inputs::each_height(row.heights, [this](std::string_view, std::optional<double> height) {
      z_.push_back(height.value());
      highest_ = std::max(highest_, *height);
    });
  }
  if (along_ > 0) across_ = z_.size() / along_;
}

}  // namespace train_derail::model
