/* A stand-in for ros2_control's header of the same name (Jazzy, Kilted): as much of its interface as our controller uses. */
#ifndef CHAINABLE_CONTROLLER_INTERFACE_HPP
#define CHAINABLE_CONTROLLER_INTERFACE_HPP

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "rclcpp/duration.hpp"
#include "rclcpp/logging.hpp"
#include "rclcpp/time.hpp"
#include "rclcpp_lifecycle/state.hpp"

namespace rclcpp
{
using Value = std::variant<double, std::string, std::vector<std::string>, std::vector<double>>;

class Parameter
{
public:
  explicit Parameter(Value value) : value_(std::move(value)) {}
  double as_double() const { return std::get<double>(value_); }
  std::string as_string() const { return std::get<std::string>(value_); }
  std::vector<std::string> as_string_array() const { return std::get<std::vector<std::string>>(value_); }
  std::vector<double> as_double_array() const { return std::get<std::vector<double>>(value_); }

private:
  Value value_;
};
}  // namespace rclcpp

namespace rclcpp_lifecycle
{
class LifecycleNode
{
public:
  const char * get_name() const { return "friction"; }
  rclcpp::Logger get_logger() const { return {}; }
  rclcpp::Parameter get_parameter(const std::string & name) const { return rclcpp::Parameter(parameters.at(name)); }
  std::map<std::string, rclcpp::Value> parameters;
};
}  // namespace rclcpp_lifecycle

namespace hardware_interface
{
class Handle
{
public:
  Handle(const std::string & prefix, const std::string & name, double * value)
  : prefix_(prefix), name_(prefix + "/" + name), value_(value)
  {
  }
  const std::string & get_name() const { return name_; }
  const std::string & get_prefix_name() const { return prefix_; }
  double * value() const { return value_; }

private:
  std::string prefix_, name_;
  double * value_;
};
class StateInterface : public Handle
{
  using Handle::Handle;
};
class CommandInterface : public Handle
{
  using Handle::Handle;
};

class LoanedStateInterface
{
public:
  explicit LoanedStateInterface(StateInterface lent, const bool * locked) : lent_(std::move(lent)), locked_(locked) {}
  LoanedStateInterface(const LoanedStateInterface &) = delete;
  LoanedStateInterface(LoanedStateInterface &&) = default;
  const std::string get_name() const { return lent_.get_name(); }
  template <typename T = double>
  [[nodiscard]] std::optional<T> get_optional(unsigned int = 10) const
  {
    return *locked_ ? std::nullopt : std::optional<T>(*lent_.value());
  }

private:
  StateInterface lent_;
  const bool * locked_;
};

class LoanedCommandInterface
{
public:
  explicit LoanedCommandInterface(CommandInterface lent, const bool * locked) : lent_(std::move(lent)), locked_(locked) {}
  LoanedCommandInterface(const LoanedCommandInterface &) = delete;
  LoanedCommandInterface(LoanedCommandInterface &&) = default;
  const std::string & get_name() const { return lent_.get_name(); }
  template <typename T>
  [[nodiscard]] bool set_value(const T & value, unsigned int = 10)
  {
    if (!*locked_) {
      *lent_.value() = value;
    }
    return !*locked_;
  }

private:
  CommandInterface lent_;
  const bool * locked_;
};
}  // namespace hardware_interface

namespace controller_interface
{
enum class CallbackReturn : std::uint8_t { SUCCESS = 0, FAILURE = 1, ERROR = 2 };
enum class return_type : std::uint8_t { OK = 0, ERROR = 1 };
enum class interface_configuration_type : std::uint8_t { ALL = 0, INDIVIDUAL = 1, NONE = 2 };

struct InterfaceConfiguration
{
  interface_configuration_type type;
  std::vector<std::string> names = {};
};

class ControllerInterfaceBase
{
public:
  virtual ~ControllerInterfaceBase() = default;
  virtual InterfaceConfiguration command_interface_configuration() const = 0;
  virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual CallbackReturn on_init() = 0;
  virtual CallbackReturn on_configure(const rclcpp_lifecycle::State &) { return CallbackReturn::SUCCESS; }
  virtual CallbackReturn on_activate(const rclcpp_lifecycle::State &) { return CallbackReturn::SUCCESS; }
  virtual CallbackReturn on_deactivate(const rclcpp_lifecycle::State &) { return CallbackReturn::SUCCESS; }
  virtual return_type update(const rclcpp::Time &, const rclcpp::Duration &) = 0;
  virtual void assign_interfaces(
    std::vector<hardware_interface::LoanedCommandInterface> && commands,
    std::vector<hardware_interface::LoanedStateInterface> && states)
  {
    command_interfaces_ = std::move(commands);
    state_interfaces_ = std::move(states);
  }
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() { return node_; }
  std::shared_ptr<const rclcpp_lifecycle::LifecycleNode> get_node() const { return node_; }
  unsigned int get_update_rate() const { return update_rate; }
  template <typename ParameterT>
  auto auto_declare(const std::string & name, const ParameterT & default_value)
  {
    return std::get<ParameterT>(node_->parameters.try_emplace(name, default_value).first->second);
  }
  unsigned int update_rate = 0;

protected:
  std::vector<hardware_interface::LoanedCommandInterface> command_interfaces_;
  std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;

private:
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node_ = std::make_shared<rclcpp_lifecycle::LifecycleNode>();
};

class ChainableControllerInterface : public ControllerInterfaceBase
{
public:
  return_type update(const rclcpp::Time & time, const rclcpp::Duration & period) final
  {
    const return_type done = chained_ ? return_type::OK : update_reference_from_subscribers(time, period);
    return done == return_type::OK ? update_and_write_commands(time, period) : done;
  }
  std::vector<hardware_interface::StateInterface> export_state_interfaces()
  {
    auto offered = on_export_state_interfaces();
    for (const auto & one : offered) {
      require_prefix(one);
    }
    return offered;
  }
  std::vector<hardware_interface::CommandInterface> export_reference_interfaces()
  {
    auto offered = on_export_reference_interfaces();
    if (reference_interfaces_.size() != offered.size()) {
      throw std::runtime_error("reference_interfaces_ has another size");
    }
    for (const auto & one : offered) {
      require_prefix(one);
    }
    return offered;
  }
  bool set_chained_mode(bool chained)
  {
    chained_ = on_set_chained_mode(chained) ? chained : chained_;
    return chained_ == chained;
  }

protected:
  virtual std::vector<hardware_interface::StateInterface> on_export_state_interfaces() { return {}; }
  virtual std::vector<hardware_interface::CommandInterface> on_export_reference_interfaces() { return {}; }
  virtual bool on_set_chained_mode(bool) { return true; }
  virtual return_type update_reference_from_subscribers(const rclcpp::Time &, const rclcpp::Duration &) = 0;
  virtual return_type update_and_write_commands(const rclcpp::Time &, const rclcpp::Duration &) = 0;
  std::vector<double> reference_interfaces_;

private:
  void require_prefix(const hardware_interface::Handle & one) const
  {
    if (one.get_prefix_name().find(get_node()->get_name()) != 0) {
      throw std::runtime_error("the prefix must begin with the controller's name");
    }
  }
  bool chained_ = false;
};
}  // namespace controller_interface

#endif
