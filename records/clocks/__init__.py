"""Checks of time: do all channels run on one clock, in step, without samples lost, stuck or made up?"""
