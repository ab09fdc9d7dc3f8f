"""Simulation of machines with set-valued friction (true stick and slip): open loop, along logs, and in closed loop."""
