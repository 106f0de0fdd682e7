"""The myCobot family: myArm 300, myCobot 280 and 320, mechArm 270, myPalletizer 260."""
