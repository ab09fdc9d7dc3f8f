#ifndef RCLCPP_DURATION_HPP
#define RCLCPP_DURATION_HPP
namespace rclcpp
{
class Duration
{
};
}  // namespace rclcpp
#endif
