MODULE arc
  LOCAL CONST robtarget a1:=[[800,-100,800],[0,-0.97969618,0,0.20048792],[-1,-1,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL CONST robtarget a2:=[[830,0,800],[0,-0.97969618,0,0.20048792],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL CONST robtarget a3:=[[800,100,800],[0,-0.97969618,0,0.20048792],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC weld()
    MoveJ a1,v100,fine,tool0;
    MoveC a2,a3,v20,fine,tool0;
    MoveC Offs(a2,0,0,5),a1,v20,fine,tool0;
  ENDPROC
ENDMODULE
