#ifndef RCLCPP_TIME_HPP
#define RCLCPP_TIME_HPP
namespace rclcpp
{
class Time
{
};
}  // namespace rclcpp
#endif
